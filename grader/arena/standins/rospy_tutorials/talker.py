#!/usr/bin/env python3
from chatter import talk

talk()
