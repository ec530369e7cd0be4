#!/bin/sh
# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

# Pin setup.py's requirements for every supported Python, with hashes: `make lock`, or
# scripts/lock.sh UV [OPTION]...
set -eu
uv=$1
shift

# One version for all Pythons where there is one, so that numbers do not depend on the interpreter.
pin() {
    output=$1
    shift
    "$uv" pip compile --no-config --quiet --universal --python-version 3.10 \
        --fork-strategy fewest --generate-hashes --constraint requirements/pythons.in \
        --custom-compile-command 'make lock' --output-file "$output" "$@"
}

# What the drive, its demo, its panel and tests of a controller need, and beside it what our tests
# and lint add.
for distribution in jazzy kilted; do
    run=requirements/$distribution.txt
    pin "$run" setup.py requirements/build.in \
        --extra "$distribution" --extra lab --extra completion --extra panel \
        --extra testing "$@"
    pin "requirements/$distribution-test.txt" setup.py requirements/build.in --constraint "$run" \
        --extra "$distribution" --extra "$distribution-test" --extra lab --extra test --extra lint "$@"
done
# What `make test-all` adds to the tests, for each distribution, and what `ARGS=--cov` does.
pin requirements/doors.txt setup.py requirements/build.in --extra doors \
    --constraint requirements/jazzy-test.txt --constraint requirements/kilted-test.txt "$@"
pin requirements/coverage.txt requirements/coverage.in \
    --constraint requirements/jazzy-test.txt --constraint requirements/kilted-test.txt "$@"
# uv, then the build tools: every environment gets them first.
pin requirements/uv.txt requirements/uv.in "$@"
pin requirements/build.txt requirements/build.in --constraint requirements/jazzy.txt "$@"
pin requirements/colcon.txt requirements/colcon.in \
    --constraint requirements/jazzy.txt --constraint requirements/kilted.txt "$@"
pin requirements/release.txt requirements/release.in "$@"
# Sphinx wants an older docutils than the tests; nothing else need be the same. So with other codes.
pin requirements/docs.txt setup.py requirements/build.in --extra lab --extra docs "$@"
pin requirements/evidence.txt setup.py requirements/build.in --extra lab --extra evidence "$@"
pin requirements/apt.txt setup.py requirements/build.in requirements/apt.in \
    --extra jazzy --extra lab --extra panel --extra formats --extra parquet --extra design "$@"
# It asks for numpy below 1.21, and runs with that of evidence.txt.
pin requirements/slippy.txt requirements/slippy.in --no-deps "$@"
