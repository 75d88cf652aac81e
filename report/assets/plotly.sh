#!/usr/bin/env bash
# Makes plotly-basic.min.js.gz and plotly-LICENSE anew from the package that plotly.js publishes.
#
#     report/assets/plotly.sh            # checks that what lies here is what this script makes
#     report/assets/plotly.sh --write    # writes it, after `version` and `integrity` were changed
#
# Needs npm and gzip. The test `the_library_is_the_one_that_the_readme_names` holds file and README together.
set -euo pipefail
cd "$(dirname "$0")"

version=4.1.1
integrity=sha512-1oNF8PeQx2hv/y7tqEVWKD3JGwn/MGEMQ8mL9HUwsaqG9FGy/OU5FHUHvzqbqxN4mnwZGI9abTiE775C4kkjMQ==

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
archive=$work/$(npm pack --silent --pack-destination "$work" "plotly.js-basic-dist-min@$version")
got=sha512-$(openssl dgst -sha512 -binary "$archive" | base64 -w 0)
if [ "$got" != "$integrity" ]; then
    echo "plotly.js-basic-dist-min $version has the sum $got, expected $integrity" >&2
    exit 1
fi
tar -xzf "$archive" -C "$work"
# Without name and time: the same bytes every time.
gzip -9 -n -c "$work/package/plotly-basic.min.js" >"$work/plotly-basic.min.js.gz"
if [ "${1:-}" = --write ]; then
    cp "$work/plotly-basic.min.js.gz" plotly-basic.min.js.gz
    cp "$work/package/LICENSE" plotly-LICENSE
    gunzip -c plotly-basic.min.js.gz | sha256sum
else
    # Another gzip may pack the same script into other bytes.
    cmp <(gunzip -c "$work/plotly-basic.min.js.gz") <(gunzip -c plotly-basic.min.js.gz)
    cmp "$work/package/LICENSE" plotly-LICENSE
    echo "plotly.js $version, as published"
fi
