#!/usr/bin/env bash
# Loads every kind of page in headless Chromium, wide and narrow, and fails where a chart is not drawn,
# the console says something, or a page offers to send data away:
#
#     tests/pages.sh [FOLDER]
#
# With FOLDER the pages stay there, each with a picture beside it, to be looked at. Installs Chromium from
# Debian's packages as root, or it must be there already.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v chromium >/dev/null; then
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium
fi

all_work=$(mktemp -d)
work=$all_work
trap 'rm -rf "$all_work"' EXIT
folder=${1:-$work/pages}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

# browse PAGE WIDTH HEIGHT OPTION…: the page as the browser has it, to standard output; what the browser
# says, to $work/said.
browse() {
    local page=$1 width=$2 height=$3
    shift 3
    rm -rf "$work/profile"
    timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run \
        --disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage \
        --user-data-dir="$work/profile" --hide-scrollbars --window-size="$width,$height" \
        --virtual-time-budget=20000 --enable-logging=stderr "$@" "file://$page" 2>"$work/said"
}

# How often a text stands in a file.
count() {
    { grep -o -- "$1" "$2" || true; } | wc -l
}

# complain PAGE WHAT…
complain() {
    echo "$1: ${*:2}" >&2
    touch "$all_work/wrong"
}

# The end of a page that is loaded: time is virtual here, and does not wait for what unpacks the charts. Work
# does take time. `waiting CHARTS TURNS`: until so many are drawn, but no more than so many turns.
waiting() {
    cat <<HTML
<script>
(() => {
  let turns = 0, sum = 0;
  const wait = () => {
    turns += 1;
    if (turns > $2 || document.querySelectorAll(".js-plotly-plot").length >= $1) return;
    for (let k = 0; k < 2e7; k += 1) sum += Math.sqrt(k);
    setTimeout(wait, 20);
  };
  wait();
})();
</script>
HTML
}

# look PAGE WIDTH: with everything unfolded, so that every chart comes into view but those of the runs
# that are not chosen.
look() {
    local page=$1 width=$2 name dom=$work/dom.html all drawn hidden
    name="$(basename "$page") at $width pixels"
    all=$(count '<div class="chart"' "$page")
    hidden=$(count '<div class="run"' "$page")
    hidden=$((hidden > 1 ? hidden - 1 : 0))
    { sed 's/<details/<details open/g' "$page"; waiting $((all - hidden)) 500; } >"$work/unfolded.html"
    browse "$work/unfolded.html" "$width" 40000 --dump-dom >"$dom" || complain "$name" "the browser failed"
    drawn=$(count 'class="chart js-plotly-plot"' "$dom")
    echo "$name: $drawn of $all charts drawn, $hidden of runs not chosen, $(stat -c %s "$page") bytes"
    # Pictures without a library: the page has nothing that could fail.
    if ! grep -q 'id="library"' "$page"; then
        grep -q '<svg class="curve"' "$dom" || complain "$name" "nothing is drawn"
        ! grep -a 'CONSOLE' "$work/said" >&2 || complain "$name" "the console says something"
        return
    fi
    [ "$drawn" -eq $((all - hidden)) ] || complain "$name" "charts are missing"
    [ "$drawn" -eq 0 ] || grep -q 'class="point\|class="js-line' "$dom" || complain "$name" "nothing is drawn in the charts"
    grep -q '<p class="box" id="trouble" hidden' "$dom" || complain "$name" "the page reports trouble"
    ! grep -qi 'data-title="[^"]*\(share\|cloud\|edit\)' "$dom" || complain "$name" "a chart can be sent away"
    ! grep -a 'CONSOLE' "$work/said" >&2 || complain "$name" "the console says something"
}

LOOPSIGHT_PAGES=$folder cargo test --workspace --locked -q --lib pages_to_look_at
pages=("$folder"/*.html)
[ "${#pages[@]}" -ge 23 ] || complain "$folder" "there are ${#pages[@]} pages, expected at least 23"
shots=$#
# look_all WIDTH: at every page, in a folder of its own, so that two of these do not meet.
look_all() {
    local width=$1 page
    work=$all_work/$width
    mkdir "$work"
    for page in "${pages[@]}"; do
        look "$page" "$width"
        if [ "$shots" -gt 0 ]; then
            { cat "$page"; waiting 9 40; } >"$work/shown.html"
            browse "$work/shown.html" "$width" 5000 --screenshot="${page%.html}_$width.png" >"$work/shot"
        fi
    done
}
# Both in the background: behind `||` a command that fails inside would not end them.
look_all 1200 &
wide=$!
look_all 420 &
wait "$wide"
wait $!

# The check itself must see what is wrong: a page whose library is cut short.
{ sed 's/\(id="library">.\{1000\}\)[^<]*/\1/' "$folder/comparison.html"; waiting 1 40; } >"$work/cut.html"
browse "$work/cut.html" 1200 3000 --dump-dom >"$work/dom.html"
if grep -q '<p class="box" id="trouble" hidden' "$work/dom.html"; then
    complain cut.html "a broken library goes unnoticed"
fi

[ ! -e "$all_work/wrong" ]
