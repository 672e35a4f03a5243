#!/bin/sh
# A solver that stays where it starts: the least that the protocol asks for, in any language that reads and writes
# lines. legopt evaluates and judges the point, whatever its solver claims.
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
