#!/usr/bin/env bash
# Friction that nobody knows of, behind a firmware: recorded through the line, found, told to the robot, and
# driven again; then told to it while it drives. LOOPSIGHT_FIRMWARE names the firmware, LOOPSIGHT the command
# (default: loopsight). Files are left in the folder `story` beside this script.
set -euo pipefail
loopsight=${LOOPSIGHT:-loopsight}
# Paths are those of the caller.
case $loopsight in */*) loopsight=$(realpath "$loopsight") ;; esac
firmware=$(realpath "${LOOPSIGHT_FIRMWARE:?names the firmware, built as the README says}")
cd "$(dirname "$0")"
rm -rf story
mkdir story

# Sockets of its own, so that two of these do not meet.
sockets=$(mktemp -d)
line=$sockets/line
qemu-system-arm -machine mps2-an386 -cpu cortex-m4 -display none -monitor none \
    -serial "unix:$line,server=on,wait=on" -kernel "$firmware" &
board=$!
trap 'kill "$board"; rm -rf "$sockets"' EXIT
for _ in $(seq 100); do
    [ -S "$line" ] && break
    sleep 0.1
done

# loop NAME FILE MODEL [SED-OPTION…]: the loop of FILE with this model, its log NAME.csv.
loop() {
    local name=$1 file=$2 model=$3
    shift 3
    sed -e "s|\"model.toml\" |\"$model\"|" -e "s|^log = .*|log = \"$name.csv\"|" \
        -e "s|\"robot.toml\"|\"../robot.toml\"|" -e "s|/tmp/twil.line|$line|" \
        -e "s|/tmp/twil.door|$sockets/door|" "$@" "$file" >"story/$name.toml"
}

# error LOG SIGNAL [from EVENT | to EVENT]: how far a signal is from its reference, root of the mean square over
# the log, or over the part of it before or after an event.
error() {
    awk -F, -v signal="$2" -v side="${3:-}" -v event="${4:-}" '
        NR == 1 { for (i = 1; i <= NF; i++) { at[$i] = i }
            y = at[signal]; r = at["reference_" signal]
            if (!y || !r) { print "the log has other columns" >"/dev/stderr"; exit 1 }
            next }
        /^#/ { if (event && index($0, event)) { seen = 1 }; next }
        side == "from" && !seen || side == "to" && seen { next }
        { d = $y - $r; sum += d * d; n++ }
        END { if (!n) { exit 1 }; printf "%.2f\n", 1000 * sqrt(sum / n) }' "$1"
}

echo "== The robot is told the model without friction, and drives: steps, to learn from."
loop steps loop.toml ../model.toml
"$loopsight" run story/steps.toml
echo "== What does the model lack?"
"$loopsight" improve model.toml story/steps.csv -o story/better.toml
echo "== How well does it follow with the model without friction?"
loop before follow.toml ../model.toml
"$loopsight" run story/before.toml
echo "== It is told the improved model, and follows again."
loop after follow.toml better.toml
"$loopsight" send story/after.toml
"$loopsight" run story/after.toml
echo "== It drives with the model without friction, and is told the improved one on the way."
loop live follow.toml ../model.toml -e "s|^duration_s = .*|duration_s = 240.0|"
"$loopsight" run story/live.toml &
run=$!
for _ in $(seq 300); do
    # Not there yet in the first moments.
    ticks=$(grep -vc '^#' story/live.csv.part 2>/dev/null || true)
    [ "${ticks:-0}" -gt 6000 ] && break
    sleep 0.05
done
"$loopsight" send story/after.toml
wait "$run"

told="the robot was told another model"
failed=0
echo "== Tracking error, rms over the whole run, steady or not:"
for signal in linear_velocity_m_per_s:mm/s angular_velocity_rad_per_s:mrad/s; do
    unit=${signal#*:} signal=${signal%:*}
    before=$(error story/before.csv "$signal") after=$(error story/after.csv "$signal")
    echo "$signal: $before $unit before, $after $unit after"
    on_the_way=$(error story/live.csv "$signal" to "$told") then=$(error story/live.csv "$signal" from "$told")
    echo "$signal, told on the way: $on_the_way $unit until then, $then $unit from then on"
    awk -v a="$before" -v b="$after" -v c="$on_the_way" -v d="$then" 'BEGIN { exit !(b < a && d < c) }' || failed=1
done
exit "$failed"
