#!/bin/sh
# Reads and steers a show with curl, through the page's server: steer.sh URL TOKEN [COMMAND [VALUE]]
#
#     bench-dragon view                                         prints http://127.0.0.1:8223/#token=TOKEN
#     sh examples/steer.sh http://127.0.0.1:8223 TOKEN          prints the status
#     sh examples/steer.sh http://127.0.0.1:8223 TOKEN hold     sends a command, and prints the reply
#     sh examples/steer.sh http://127.0.0.1:8223 TOKEN seek 120
set -eu
view=$1 token=$2 command=${3:-} value=${4:-}

ask() {
    curl --silent --show-error --fail-with-body --header "X-Bench-Dragon-Token: $token" "$@"
}

if [ -z "$command" ]; then
    ask "$view/status"
else
    ask --json "{\"command\": \"$command\"${value:+, \"value\": $value}}" "$view/command"
fi
