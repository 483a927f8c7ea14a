"""A data set by two workers of Ray, one of which is killed half-way: nothing is lost, nothing is there twice.

    pip install ray && python python/examples/ray_dataset.py --into set

renders 1,000 notes of 0.5 s, which differ in pitch, mouth pressure, embouchure and reed, into Parquet files and a manifest. On a
cluster, give `ray.init` the address of its head instead of the two workers, give a folder that all machines see, and leave out
what kills a worker: it knows processes of this machine only.
"""

import argparse
import os
import signal
import time

import chalumeau
import pyarrow.parquet
import ray

NOTES = ["E3", "G3", "A#3", "C4", "D4", "F4", "G4", "B4", "D5", "G5"]
REEDS = [2.0, 2.5, 3.0, 3.5]


def plan(steps: int) -> dict:
    """Ten notes, four reeds, five embouchures and so many mouth pressures."""
    return {
        "same": {"seconds": 0.5},
        "vary": {
            "written": NOTES,
            "strength": REEDS,
            "zeta": {"from": 0.2, "to": 0.32, "steps": 5},
            "gamma": {"from": 0.42, "to": 0.54, "steps": steps},
        },
    }


@ray.remote(max_retries=3)
def work(part):
    """One part, and who made it."""
    return os.getpid(), chalumeau.datasets.render_part(part)


def on_two_workers(kill_after: float):
    """What `dataset` maps with: two lines, but that it kills a worker once a share of the parts is done."""

    def map_parts(_, parts):
        left = [work.remote(part) for part in parts]
        is_killed = False
        while left:
            [ready], left = ray.wait(left, num_returns=1)
            worker, done = ray.get(ready)
            if not is_killed and len(parts) - len(left) >= kill_after * len(parts):
                is_killed = True
                os.kill(worker, signal.SIGKILL)
                print(f"a worker was killed after {len(parts) - len(left)} of {len(parts)} parts", flush=True)
            yield done

    return map_parts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--into", required=True, metavar="FOLDER")
    parser.add_argument("--pressures", type=int, default=5, metavar="N", help="mouth pressures; each makes 200 rows (default 5)")
    chosen = parser.parse_args()
    rows = 200 * chosen.pressures
    began = time.monotonic()
    ray.init(num_cpus=2, include_dashboard=False)
    report = chalumeau.dataset(plan(chosen.pressures), chosen.into, map=on_two_workers(kill_after=0.5), rows_per_part=10)
    print(report)
    ray.shutdown()
    numbers = pyarrow.parquet.read_table(f"{chosen.into}/parquet", columns=["row"])["row"].to_pylist()
    if sorted(numbers) != list(range(1, rows + 1)):
        raise SystemExit(f"{len(numbers)} rows, {len(set(numbers))} different: some were lost or came twice")
    print(f"{len(numbers)} rows, each once, in {time.monotonic() - began:.1f} s with the start of Ray")


if __name__ == "__main__":
    main()
