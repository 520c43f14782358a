#!/usr/bin/env bash
# Makes a dataset in N parts as a Slurm job array on a shared file system, then joins them in a job that waits for
# all of them. A part that is requeued or submitted again goes on where it stopped.
#
#   deploy/cluster/slurm.sh CONFIG.toml OUT N [sbatch options]
set -euo pipefail
config=$1 out=$2 parts=$3
shift 3
uw=${UW:-uw}
mkdir -p "$out"
array=$(sbatch --parsable --requeue --job-name=uw-dataset --array="1-$parts" --cpus-per-task="${THREADS:-2}" \
    --output="$out/part-%a.log" --open-mode=append "$@" \
    --wrap="'$uw' dataset '$config' -o '$out'/part-\$SLURM_ARRAY_TASK_ID --shard \$SLURM_ARRAY_TASK_ID/$parts --threads \$SLURM_CPUS_PER_TASK")
sbatch --dependency="afterok:$array" --job-name=uw-join --cpus-per-task="${THREADS:-2}" --output="$out/join.log" "$@" \
    --wrap="'$uw' dataset '$config' -o '$out' --merge '$out'/part-[0-9]*"
