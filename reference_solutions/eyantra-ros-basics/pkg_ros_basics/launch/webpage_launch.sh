#!/bin/bash

URL="https://www.e-yantra.org/"

echo "** Opening $URL in Firefox **"
firefox -new-window $URL
