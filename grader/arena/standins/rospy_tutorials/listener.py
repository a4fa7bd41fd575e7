#!/usr/bin/env python3
from chatter import listen

listen()
