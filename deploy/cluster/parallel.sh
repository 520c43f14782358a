#!/usr/bin/env bash
# Makes a dataset in N parts with GNU parallel, on this machine or on several (a list of hosts with a shared folder),
# and joins them. A part that fails or is killed is started again, up to three times; run the script again to go on.
#
#   deploy/cluster/parallel.sh CONFIG.toml OUT N [HOSTFILE]
#
# UW names the program (default: uw on the PATH), THREADS those of each part (default 1).
set -euo pipefail
config=$1 out=$2 parts=$3 hosts=${4:-}
uw=${UW:-uw} threads=${THREADS:-1}
mkdir -p "$out"
[ -z "$hosts" ] || hosts="--sshloginfile $hosts --workdir $PWD"
# shellcheck disable=SC2086
seq "$parts" | parallel $hosts --jobs "${JOBS:-100%}" --retries 3 --joblog "$out/parts.log" --line-buffer --tag \
    "$uw" dataset "$config" -o "$out/part-{}" --shard "{}/$parts" --threads "$threads"
"$uw" dataset "$config" -o "$out" --merge "$out"/part-[0-9]* --threads "$threads"
