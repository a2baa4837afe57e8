#!/usr/bin/env bash
# ends.sh PROGRAM HOW SENTENCE: one of three ranks ends in this way, and so does the job: within seconds, with a status that
# is not 0, and with a sentence that matches.
set -uo pipefail
command -v mpirun > /dev/null || { echo 'skipped: mpirun is not installed'; exit 0; }
begin=$SECONDS
said=$(timeout -k 5 60 "$(dirname "${BASH_SOURCE[0]}")/on_ranks.sh" 3 "$1" "$2" 2>&1)
status=$?
took=$((SECONDS - begin))
echo "$said"
echo "status $status after $took s"
[ $status != 0 ] || { echo 'the job says that all went well'; exit 1; }
[ $took -lt 20 ] || { echo 'the job went on'; exit 1; }
grep -Eq "$3" <<< "$said" || { echo "no sentence matches: $3"; exit 1; }
