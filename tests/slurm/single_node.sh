#!/usr/bin/env bash
# A SLURM of one node on this machine for tests, from the Debian packages slurm-wlm and munge; nothing of an installed
# SLURM is touched: configuration, key, state and logs lie in one folder, all traffic is on 127.0.0.1.
#
#   sudo apt-get install slurm-wlm munge
#   tests/slurm/single_node.sh start /tmp/slurm && source /tmp/slurm/environment
#   sbatch --wrap hostname; squeue
#   tests/slurm/single_node.sh stop /tmp/slurm
#
# As root, or as a user who then owns daemons and jobs.
set -euo pipefail
usage() { echo "usage: $0 start|stop FOLDER" >&2; exit 2; }
[ $# -eq 2 ] || usage
folder=$2

stop() {
    for name in slurmd slurmctld munged; do
        if [ -s "$folder/$name.pid" ]; then kill "$(cat "$folder/$name.pid")" 2>/dev/null || true; fi
    done
}

start() {
    local missing=""
    for program in munged slurmctld slurmd sbatch; do
        command -v "$program" >/dev/null || PATH="$PATH:/usr/sbin" command -v "$program" >/dev/null || missing+=" $program"
    done
    if [ -n "$missing" ]; then echo "missing:$missing; apt-get install slurm-wlm munge" >&2; exit 1; fi
    export PATH="$PATH:/usr/sbin"
    mkdir -p "$folder/state" "$folder/spool"
    chmod 755 "$folder"
    local host user
    host=$(hostname -s)
    user=$(id -un)
    dd if=/dev/urandom of="$folder/munge.key" bs=1 count=1024 status=none
    chmod 400 "$folder/munge.key"
    cat >"$folder/slurm.conf" <<CONF
ClusterName=single
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CryptoType=crypto/munge
SlurmUser=$user
SlurmdUser=$user
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=4000 State=UNKNOWN
PartitionName=debug Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
    echo "export SLURM_CONF=$folder/slurm.conf" >"$folder/environment"
    export SLURM_CONF=$folder/slurm.conf
    munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
        --log-file="$folder/munged.log" --seed-file="$folder/munge.seed"
    slurmctld
    slurmd
    for _ in $(seq 60); do
        if sinfo --noheader --format=%t 2>/dev/null | grep -q '^idle'; then
            echo "SLURM is up: source $folder/environment"
            return
        fi
        sleep 0.5
    done
    echo "SLURM did not come up; see the logs in $folder" >&2
    stop
    exit 1
}

case $1 in
    start) start ;;
    stop) stop ;;
    *) usage ;;
esac
