#!/usr/bin/env bash
# Run a command beside a Slurm cluster of one node, on Debian or Ubuntu, without systemd:
#
#   tests/workflow/slurm.sh snakemake --profile profiles/slurm
#
# Slurm and munge are installed where they are missing, which takes root. All of their files lie in
# a temporary folder, and all of their processes end with the command. SLURM_TEST_CPUS is the
# number of processors of the node: 2 unless told.
set -euo pipefail

if ! command -v slurmctld munged >/dev/null; then
    apt-get install -y --no-install-recommends slurm-wlm munge
fi
PATH=$PATH:/usr/sbin

folder=$(mktemp -d)
chmod 755 "$folder" # munged refuses a socket that others cannot reach
node=$(hostname -s)
export SLURM_CONF=$folder/slurm.conf
started=()

stop() {
    scancel --user="$(id -un)" 2>/dev/null || true
    for ((i = ${#started[@]} - 1; i >= 0; i--)); do
        kill "${started[i]}" 2>/dev/null || true
    done
    wait
    rm -rf "$folder"
}
trap stop EXIT

# Ports are of this process, so two of these clusters can live on one machine.
port=$((20000 + 2 * ($$ % 10000)))
memory=$(awk '/MemAvailable/ { print int($2 / 1024) }' /proc/meminfo)
cat >"$SLURM_CONF" <<CONF
ClusterName=test
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
# No cgroups and no accounting: neither works in a container.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
# Seconds for which Slurm remembers a job that has ended.
MinJobAge=7200
ReturnToService=2
NodeName=$node NodeAddr=127.0.0.1 CPUs=${SLURM_TEST_CPUS:-2} RealMemory=$memory State=UNKNOWN
PartitionName=test Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF

# The executor of Snakemake takes SLURM_CONF, like all of Slurm's variables, from the jobs' srun.
mkdir "$folder/state" "$folder/spool" "$folder/bin"
printf '#!/bin/sh\nSLURM_CONF=%s exec %s "$@"\n' "$SLURM_CONF" "$(command -v srun)" >"$folder/bin/srun"
chmod 755 "$folder/bin/srun"
export PATH=$folder/bin:$PATH

dd if=/dev/urandom of="$folder/munge.key" bs=128 count=1 status=none
chmod 600 "$folder/munge.key"
munged --foreground --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
    --pid-file="$folder/munge.pid" --log-file="$folder/munge.log" --seed-file="$folder/munge.seed" 2>/dev/null &
started+=($!)
slurmctld -D >"$folder/slurmctld.log" 2>&1 &
started+=($!)
slurmd -D -N "$node" >"$folder/slurmd.log" 2>&1 &
started+=($!)

for _ in {1..60}; do
    if [[ $(sinfo --noheader --format=%T 2>/dev/null) == idle ]]; then
        "$@"
        exit
    fi
    sleep 0.5
done
echo "Slurm did not start:" >&2
tail -n 20 "$folder"/*.log >&2
exit 1
