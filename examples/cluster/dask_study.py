#!/usr/bin/env python3
"""Runs the parts of a study on a Dask cluster and joins them.

    python examples/cluster/dask_study.py --parts 8 --output out/study -- \
        scenes/study/twist-nano-soft.toml --vary solver.tolerance=1e-3,1e-2

Each part is `selvedge study … --shard I/N` in a process of its own, in a folder
that all workers see. A part whose worker died is submitted again and goes on with
the runs that were finished. Without --scheduler two workers are started on this
machine, bound to 127.0.0.1.

Needs: pip install "dask[distributed]"
"""

import argparse
import ctypes
import signal
import subprocess
import sys
import time

from dask.distributed import Client, LocalCluster, as_completed
from distributed.scheduler import KilledWorker


def die_with_worker():
    """Linux: a part does not outlive the worker that started it."""
    if sys.platform == "linux":
        PR_SET_PDEATHSIG = 1
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def part(command):
    """One part; the worker waits for it."""
    while True:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, preexec_fn=die_with_worker
        )
        # The process of a worker that died may take a moment to end.
        if done.returncode != 2 or "in use by another process" not in done.stderr:
            return done.returncode, done.stderr
        time.sleep(1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="selvedge")
    parser.add_argument("--scheduler", help="address of a running cluster")
    parser.add_argument("--parts", type=int, default=4)
    parser.add_argument("--output", required=True, help="folder that all workers see")
    parser.add_argument("--attempts", type=int, default=5, help="tries of every part")
    parser.add_argument("study", nargs="+", help="arguments of `selvedge study`, after --")
    args = parser.parse_args()

    base = [args.program, "study", *args.study, "--output", args.output, "--resume"]
    if args.scheduler:
        cluster, client = None, Client(args.scheduler)
    else:
        cluster = LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True,
            host="127.0.0.1", dashboard_address=None,
        )
        client = Client(cluster)
    pids = client.run(lambda: __import__("os").getpid())
    print("workers:", *sorted(pids.values()), flush=True)

    def submit(index):
        # pure=False: a part that is submitted again has to run again.
        command = [*base, "--shard", f"{index}/{args.parts}"]
        return client.submit(part, command, pure=False, retries=0)

    futures = {submit(i): i for i in range(args.parts)}
    tries = dict.fromkeys(range(args.parts), 1)
    failed = []
    pool = as_completed(list(futures))
    for future in pool:
        index = futures.pop(future)
        reason = None
        if future.status == "error":
            reason = "its worker died"
            if not isinstance(future.exception(), KilledWorker):
                reason = repr(future.exception())
        else:
            status, errors = future.result()
            if status == 2:
                # Wrong input stays wrong.
                sys.exit(f"part {index}: {errors.strip()}")
            if status != 0:
                reason = f"status {status}: {errors.strip()[-300:]}"
        if reason is None:
            print(f"part {index}/{args.parts}: done", flush=True)
        elif tries[index] < args.attempts:
            tries[index] += 1
            print(f"part {index}/{args.parts}: {reason}; submitted again", flush=True)
            again = submit(index)
            futures[again] = index
            pool.add(again)
        else:
            failed.append(index)
    client.close()
    if cluster is not None:
        cluster.close()
    if failed:
        sys.exit(f"parts {failed} failed {args.attempts} times; what is finished is kept")
    sys.exit(subprocess.run([args.program, "study", "--collect", args.output], check=False).returncode)


if __name__ == "__main__":
    main()
