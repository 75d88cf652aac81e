#!/usr/bin/env bash
# Friction that nobody knows of, behind a firmware: recorded through the line, found, told to the robot, and
# driven again. LOOPSIGHT_FIRMWARE names the firmware, LOOPSIGHT the command (default: loopsight).
set -euo pipefail
cd "$(dirname "$0")"
loopsight=${LOOPSIGHT:-loopsight}
line=/tmp/twil.line

rm -f "$line"
qemu-system-arm -machine mps2-an386 -cpu cortex-m4 -display none -monitor none \
    -serial "unix:$line,server=on,wait=on" -kernel "$LOOPSIGHT_FIRMWARE" &
board=$!
trap 'kill "$board"; rm -f "$line"' EXIT
for _ in $(seq 100); do
    [ -S "$line" ] && break
    sleep 0.1
done

# How far the forward speed is from its reference, root of the mean square over a log, mm/s. Most of it is
# what the steps themselves cost, and one count of the encoders is 1.9 mm/s.
error() {
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { at[$i] = i }
            y = at["linear_velocity_m_per_s"]; r = at["reference_linear_velocity_m_per_s"]
            if (!y || !r) { print "the log has other columns" >"/dev/stderr"; exit 1 }
            next }
        /^#/ { next }
        { d = $y - $r; sum += d * d; n++ }
        END { if (n) { printf "%.3f\n", 1000 * sqrt(sum / n) } }' "$1"
}

echo "== The robot is told the model without friction, and drives."
"$loopsight" run loop.toml
echo "== What does the model lack?"
"$loopsight" improve model.toml loop.csv -o better.toml
sed -e 's/"model.toml" /"better.toml"/' -e 's/"loop.csv"/"better.csv"/' loop.toml >better_loop.toml
echo "== Does the robot take the improved model?"
"$loopsight" send better_loop.toml
echo "== It is told the improved model, and drives again."
"$loopsight" run better_loop.toml
before=$(error loop.csv) after=$(error better.csv)
echo "tracking error, rms: $before mm/s before, $after mm/s after"
awk -v before="$before" -v after="$after" 'BEGIN { exit !(after < before) }'
