# To be sourced: a Slurm of two nodes on this machine, to try things on. Needs root, and Debian's
# slurm-wlm and munge. Each node is a slurmd in its own PID namespace: when killed, all that runs on
# the node is gone, as when a machine dies.
#   start_cluster DIR    DIR holds all that it writes; sets SLURM_CONF
#   kill_node NAME       n1 or n2
#   start_node NAME
#   stop_cluster

start_cluster() {
  cluster=$(realpath "$1")
  local port=$((20000 + RANDOM % 10000)) host
  host=$(hostname -s)
  mkdir -p "$cluster/state" "$cluster/spool" "$cluster/log"
  (umask 077 && head -c 1024 /dev/urandom >"$cluster/munge.key")
  # A task that was requeued may start once its old credential has expired.
  cat >"$cluster/slurm.conf" <<TEXT
ClusterName=ist
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$cluster/munge.socket,cred_expire=5
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool/%n
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/%n.pid
SlurmctldLogFile=$cluster/log/slurmctld.log
SlurmdLogFile=$cluster/log/%n.log
SlurmctldPort=$port
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
ReturnToService=2
MpiDefault=none
KillWait=2
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1
PartitionName=main Nodes=n1,n2 Default=YES
TEXT
  export SLURM_CONF=$cluster/slurm.conf
  declare -gA node_process=()
  munged --foreground --force --socket="$cluster/munge.socket" --key-file="$cluster/munge.key" \
    --pid-file="$cluster/munge.pid" --log-file="$cluster/log/munge.log" \
    --seed-file="$cluster/munge.seed" >"$cluster/log/munged.out" 2>&1 &
  munge_process=$!
  wait_for test -S "$cluster/munge.socket"
  slurmctld -D >"$cluster/log/slurmctld.out" 2>&1 &
  control_process=$!
  start_node n1
  start_node n2
  wait_for nodes_are_idle
}

start_node() {
  unshare --fork --pid --mount-proc --kill-child slurmd -D -N "$1" >"$cluster/log/$1.out" 2>&1 &
  node_process[$1]=$!
}

kill_node() {
  # The first process of the namespace takes all others with it.
  pkill -KILL --parent "${node_process[$1]}"
  wait "${node_process[$1]}" 2>/dev/null || true
}

stop_cluster() {
  local node
  for node in "${!node_process[@]}"; do kill_node "$node" || true; done
  kill "${control_process:-}" "${munge_process:-}" 2>/dev/null || true
  wait "${control_process:-}" "${munge_process:-}" 2>/dev/null || true
}

nodes_are_back() { [[ -z $(sinfo -h -N -t down,unknown -o %N 2>/dev/null) ]]; }
nodes_are_idle() { [[ $(sinfo -h -N -o %T 2>/dev/null | grep -c idle) == 2 ]]; }

# wait_for COMMAND…: until it succeeds, or a minute is over.
wait_for() {
  local i
  for ((i = 0; i < 300; ++i)); do
    if "$@"; then return 0; fi
    sleep 0.2
  done
  echo "waited a minute for: $*" >&2
  return 1
}
