#!/usr/bin/env bash
# Makes a dataset in N parts as a Slurm job array on a shared file system, then joins them in a job that waits for
# all of them. A part that fails or whose program is killed puts itself back into the queue, up to three times, and one
# whose machine fails is put back by Slurm; either goes on where it stopped. When a part fails for good the join is
# cancelled: run the script again to go on.
#
#   deploy/cluster/slurm.sh CONFIG.toml OUT N [sbatch options]
#
# UW names the program (default: uw on the PATH), THREADS those of each part (default 2).
set -euo pipefail
config=$1 out=$2 parts=$3
shift 3
uw=${UW:-uw}
mkdir -p "$out"
array=$(sbatch --parsable --requeue --job-name=uw-dataset --array="1-$parts" --cpus-per-task="${THREADS:-2}" \
    --output="$out/part-%a.log" --open-mode=append "$@" \
    --wrap="'$uw' dataset '$config' -o '$out'/part-\$SLURM_ARRAY_TASK_ID --shard \$SLURM_ARRAY_TASK_ID/$parts \
        --threads \$SLURM_CPUS_PER_TASK
    status=\$?
    # 2 is bad input, which would be as bad the next time.
    case \$status in 0|2) exit \$status;; esac
    [ \"\${SLURM_RESTART_COUNT:-0}\" -lt 3 ] && scontrol requeue \"\$SLURM_JOB_ID\"
    exit \$status")
sbatch --dependency="afterok:$array" --kill-on-invalid-dep=yes --job-name=uw-join --cpus-per-task="${THREADS:-2}" \
    --output="$out/join.log" "$@" \
    --wrap="'$uw' dataset '$config' -o '$out' --merge '$out'/part-[0-9]*/ --threads \$SLURM_CPUS_PER_TASK"
