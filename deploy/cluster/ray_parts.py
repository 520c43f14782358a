#!/usr/bin/env python3
"""Makes a dataset in N parts on a Ray cluster with a shared folder, and joins them.

    python3 deploy/cluster/ray_parts.py CONFIG.toml OUT N [--uw PATH] [--address auto] [--threads 1]

A part whose worker dies is started again elsewhere and goes on where it stopped.
"""
import argparse
import subprocess

import ray


@ray.remote(max_retries=3, retry_exceptions=True)
def part(uw, config, out, index, parts, threads):
    command = [uw, "dataset", config, "-o", f"{out}/part-{index}", "--shard", f"{index}/{parts}"]
    subprocess.run([*command, "--threads", str(threads), "--quiet"], check=True)
    return index


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config")
    parser.add_argument("out")
    parser.add_argument("parts", type=int)
    parser.add_argument("--uw", default="uw")
    parser.add_argument("--address", help="address of a running cluster; without it one is started here")
    parser.add_argument("--threads", type=int, default=1)
    a = parser.parse_args()
    ray.init(address=a.address)
    remote = part.options(num_cpus=a.threads)
    waiting = [remote.remote(a.uw, a.config, a.out, i, a.parts, a.threads) for i in range(1, a.parts + 1)]
    while waiting:
        done, waiting = ray.wait(waiting)
        print(f"part {ray.get(done[0])} is done, {len(waiting)} left", flush=True)
    folders = [f"{a.out}/part-{i}" for i in range(1, a.parts + 1)]
    subprocess.run([a.uw, "dataset", a.config, "-o", a.out, "--merge", *folders], check=True)


if __name__ == "__main__":
    main()
