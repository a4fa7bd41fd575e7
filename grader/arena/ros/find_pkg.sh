#!/bin/sh
# Stands before `catkin_find_pkg`, of which every build asks whether catkin itself lies in the workspace. Where each
# manifest names its package in a line of its own, and none of them catkin, it does not; else the real one is asked.
plain='
  FNR == 1 { files++ }
  /<name/ { names++; if ($0 !~ /^[ \t]*<name>[A-Za-z0-9_-]+<\/name>[ \t\r]*$/ || />catkin</) odd = 1 }
  END { exit odd || names != files || files == 0 }
'
if [ "$#" = 2 ] && [ "$1" = catkin ] && find -L "$2" -name package.xml -exec awk "$plain" {} + 2>/dev/null; then
  echo "Could not find package 'catkin'." >&2
  exit 2
fi
here=${0%/*}
IFS=:
for folder in $PATH; do
  [ "$folder" != "$here" ] && [ -x "$folder/catkin_find_pkg" ] && exec "$folder/catkin_find_pkg" "$@"
done
echo "catkin_find_pkg: not found" >&2
exit 127
