"""The Python programs in examples/, run as a user runs them: python python_examples.py [word..]

All tests, or those whose name contains one of the words.
"""

import os
import subprocess
import sys

import python_bridge
import python_kit
import python_null_study
import python_study


def help_tells_what_there_is():
    analyse, bridge = python_study.ANALYSE, python_bridge.BRIDGE
    simulate = python_kit.EXAMPLES / "simulate_study.py"
    told_by = ((analyse, ("--thresholds", "summary.csv")), (bridge, ("--interface", "NOT TRIED ON")), (simulate, ("--tremble",)))
    for program, words in told_by:
        told = subprocess.run([sys.executable, program, "--help"], capture_output=True, text=True, check=False)
        assert told.returncode == 0 and all(word in told.stdout for word in words), told.stdout


TESTS = [help_tells_what_there_is, *python_study.TESTS, *python_kit.TESTS, *python_bridge.TESTS, *python_null_study.TESTS]


def main():
    os.environ.pop("DISPLAY", None)
    chosen = [test for test in TESTS if len(sys.argv) < 2 or any(word in test.__name__ for word in sys.argv[1:])]
    failed = 0
    for test in chosen:
        try:
            test()
            print(f"test {test.__name__} ... ok", flush=True)
        except Exception as error:  # each test is to be heard
            failed += 1
            print(f"test {test.__name__} ... FAILED: {type(error).__name__} {error}", flush=True)
    print(f"Python examples: {len(chosen) - failed} passed, {failed} failed")
    return failed != 0


# Processes that a test starts import this file.
if __name__ == "__main__":
    sys.exit(main())
