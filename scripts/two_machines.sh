#!/usr/bin/env bash
# Runs ranks of MPI on two machines that are none: network namespaces with a virtual cable between them, and a name each.
# Needs root and Open MPI.
#
#   scripts/two_machines.sh [--pull SECONDS] COUNT PROGRAM [ARGUMENT...]
#
# Half of the ranks run on each. After so many seconds, the cable is pulled.
#
#   scripts/two_machines.sh 4 build/release/tests/cilantro_ranks check
#   scripts/two_machines.sh --pull 3 4 build/release/tests/cilantro_ranks works      # mpirun notices, after ten seconds
#   scripts/two_machines.sh --pull 3 4 build/release/tests/cilantro_ranks works 5    # ranks notice, after five
set -uo pipefail

pull=
if [ "${1-}" = --pull ]; then pull=$2; shift 2; fi
[ $# -ge 2 ] || { sed -n '5,11s/^# \{0,1\}//p' "$0" >&2; exit 2; }
count=$1
shift

# Addresses of the range for documentation.
folder=$(mktemp -d)
a=cilantro-a-$$ b=cilantro-b-$$
clean() {
  for machine in $a $b; do
    ip netns pids $machine | xargs -r kill -9
    ip netns delete $machine
  done
  rm -rf "$folder"
}
trap clean EXIT
for machine in $a $b; do
  ip netns add $machine
  ip -n $machine link set lo up
done
ip -n $a link add cable type veth peer name cable netns $b
ip -n $a address add 192.0.2.1/24 dev cable
ip -n $b address add 192.0.2.2/24 dev cable
ip -n $a link set cable up
ip -n $b link set cable up

# What mpirun takes for ssh: the first argument is the machine.
cat > "$folder/on_machine" <<END
#!/bin/sh
machine=$b name=machine-b
if [ "\$1" = 192.0.2.1 ]; then machine=$a name=machine-a; fi
shift
exec ip netns exec \$machine unshare --uts sh -c "hostname \$name && \$*"
END
chmod +x "$folder/on_machine"
# What is underway when the cable is pulled is given up after half a minute, not after a quarter of an hour.
for machine in $a $b; do ip netns exec $machine sysctl -qw net.ipv4.tcp_retries2=6; done
half=$(((count + 1) / 2))
begin=$SECONDS
"$folder/on_machine" 192.0.2.1 mpirun --allow-run-as-root --oversubscribe --bind-to none --mca plm_rsh_agent "$folder/on_machine" \
  --mca btl tcp,self --mca btl_tcp_if_include cable --mca oob_tcp_if_include cable \
  --mca oob_tcp_keepalive_time 5 --mca oob_tcp_keepalive_intvl 2 --mca oob_tcp_keepalive_probes 3 \
  --host 192.0.2.1:$half,192.0.2.2:$((count - half)) --map-by slot -n "$count" "$@" &
job=$!
if [ -n "$pull" ]; then
  sleep "$pull"
  ip -n $a link set cable down
  echo "the cable is pulled after $((SECONDS - begin)) s"
fi
wait $job
status=$?
echo "status $status after $((SECONDS - begin)) s"
left=$(ip netns pids $a; ip netns pids $b)
[ -z "$left" ] || { sleep 10; left=$(ip netns pids $a; ip netns pids $b); }
[ -z "$left" ] || echo "ten seconds later, still there: $(ps -o args= -p "$(echo $left | tr ' ' ,)" | tr '\n' ';')"
exit $status
