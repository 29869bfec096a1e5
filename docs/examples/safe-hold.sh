#!/bin/bash
# Hold the balloon, read the force five times, and vent: at the end, after each error, and after Ctrl-C.
# Arguments: the address of the instrument, for example --host 192.168.1.20 --port 5020.
set -eu
address=("$@")
hold=

finish() {
    code=$?
    trap '' INT TERM HUP  # a second signal must not end the vent
    if [ "$hold" ]; then kill "$hold" || true; fi 2>/dev/null  # the hold vents, too
    pneuforce vent "${address[@]}" >&2 || code=$?  # the vent prints what to do if it is not verified
    exit "$code"
}
trap finish EXIT
trap 'exit 1' INT TERM HUP

pneuforce hold 6.5 "${address[@]}" >&2 &
hold=$!
for number in 1 2 3 4 5; do
    sleep 2
    kill -0 "$hold" 2>/dev/null  # if the hold has ended, for example after a trip, the script ends here
    pneuforce status --json "${address[@]}"
done
