"""A data set by two workers of Dask, one of which is killed half-way: nothing is lost, nothing is there twice.

    python python/examples/dask_dataset.py --into set

renders 1,000 notes of 0.5 s, which differ in pitch, mouth pressure, embouchure and reed, into Parquet files and a manifest. On a
cluster, give `Client` the address of its scheduler instead of the two workers, give a folder that all machines see, and leave out
what kills a worker: it knows processes of this machine only.
"""

import argparse
import os
import signal
import time

import chalumeau
import pyarrow.parquet
from dask.distributed import Client, LocalCluster, as_completed

NOTES = ["E3", "G3", "A#3", "C4", "D4", "F4", "G4", "B4", "D5", "G5"]


def plan(rows: int) -> list[dict]:
    """Rows of ten notes, four reeds and as many mouth pressures and embouchures as it takes."""
    all_rows = []
    for n in range(rows):
        steps = n // 40
        all_rows.append(
            {
                "written": NOTES[n % 10],
                "strength": [2.0, 2.5, 3.0, 3.5][n // 10 % 4],
                "gamma": round(0.42 + 0.03 * (steps % 5), 3),
                "zeta": round(0.2 + 0.03 * (steps // 5), 3),
                "seconds": 0.5,
            }
        )
    return all_rows


def on_two_workers(client: Client, kill_after: float):
    """What `dataset` maps with: two lines, but that it kills a worker once a share of the parts is done."""

    def map_parts(work, parts):
        processes = client.run(os.getpid)
        futures = client.map(work, parts, pure=False)
        for count, future in enumerate(as_completed(futures), 1):
            if processes and count >= kill_after * len(parts):
                os.kill(processes.popitem()[1], signal.SIGKILL)
                processes.clear()
                print(f"a worker was killed after {count} of {len(parts)} parts", flush=True)
            yield future.result()

    return map_parts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--into", required=True, metavar="FOLDER")
    parser.add_argument("--rows", type=int, default=1_000)
    chosen = parser.parse_args()
    began = time.monotonic()
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        half_way = on_two_workers(client, kill_after=0.5)
        report = chalumeau.dataset(plan(chosen.rows), chosen.into, map=half_way, rows_per_part=10)
        print(report)
    numbers = pyarrow.parquet.read_table(f"{chosen.into}/parquet", columns=["row"])["row"].to_pylist()
    if sorted(numbers) != list(range(1, chosen.rows + 1)):
        raise SystemExit(f"{len(numbers)} rows, {len(set(numbers))} different: some were lost or came twice")
    print(f"{len(numbers)} rows, each once, in {time.monotonic() - began:.1f} s with the start of Dask")


if __name__ == "__main__":
    main()
