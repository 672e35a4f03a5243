#!/bin/sh
# A solver that returns its start: the minimum that the protocol requires, possible in any language that reads and
# writes lines. legopt evaluates and judges the point, independent of the solver's status.
echo '{"type": "hello", "protocol": 1, "name": "stay", "version": "1"}'
while read -r line; do
  case $line in
    *'"type":"solve"'*)
      count=$(echo "$line" | sed 's/.*"variables":\([0-9]*\).*/\1/')
      zeros=$(yes 0 | head -n "$count" | paste -sd, -)
      echo "{\"type\": \"solution\", \"x\": [$zeros], \"status\": \"limit\"}"
      ;;
  esac
done
