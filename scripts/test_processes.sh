#!/bin/sh
# Prints how many processes are to run the tests. Some tests wait: three for every two processors keep
# these computing, and each imports all that is tested. No more than one for every two gigabytes of
# memory, where the system tells it.
set -eu
most=8
wanted=$((($(getconf _NPROCESSORS_ONLN) * 3 + 1) / 2))
if pages=$(getconf _PHYS_PAGES 2>/dev/null); then
  fit=$((pages * $(getconf PAGE_SIZE) / 2000000000))
  most=$((fit < 1 ? 1 : fit < most ? fit : most))
fi
echo $((wanted < most ? wanted : most))
