#!/bin/sh
# Stands in for programs by which a script asks whether there is a network or a screen: there is, as on any desktop.
case "${0##*/} $*" in
  *http_code*) printf 200 ;;
  ping*) echo "1 packets transmitted, 1 received, 0% packet loss, time 0ms" ;;
esac
exit 0
