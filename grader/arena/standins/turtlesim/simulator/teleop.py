"""The node `teleop_turtle`: arrow keys become velocity commands. Without a keyboard it stays up and waits."""

import contextlib
import os
import signal
import termios
import threading

import rospy
from geometry_msgs.msg import Twist

STDIN = 0
KEYS = {b"A": (1, 0), b"B": (-1, 0), b"C": (0, -1), b"D": (0, 1)}
"""The last byte of what an arrow key sends: forward and turning."""
QUIT = b"q"
SCALE = 2.0


@contextlib.contextmanager
def raw_keys():
    """Keys as they are pressed, not by line; as it was at the end. What is no terminal is left alone."""
    try:
        before = termios.tcgetattr(STDIN)
    except termios.error:
        yield
        return
    raw = termios.tcgetattr(STDIN)
    raw[3] &= ~(termios.ICANON | termios.ECHO)
    termios.tcsetattr(STDIN, termios.TCSANOW, raw)
    try:
        yield
    finally:
        termios.tcsetattr(STDIN, termios.TCSANOW, before)


def read_keys(publisher, linear, angular):
    """Publish a command for each arrow key, until there are no more keys."""
    while True:
        try:
            key = os.read(STDIN, 1)
        except OSError:
            key = b""
        if not key:
            rospy.logwarn("There is no keyboard to read from: this node stays up and sends nothing.")
            return
        if key == QUIT:
            rospy.signal_shutdown("q was pressed")
            return
        if key in KEYS:
            forward, turning = KEYS[key]
            twist = Twist()
            twist.linear.x, twist.angular.z = linear * forward, angular * turning
            publisher.publish(twist)


def main():
    for stop in (signal.SIGTTIN, signal.SIGTTOU):  # in the background of a terminal: go on without it
        signal.signal(stop, signal.SIG_IGN)
    rospy.init_node("teleop_turtle")
    linear, angular = rospy.get_param("scale_linear", SCALE), rospy.get_param("scale_angular", SCALE)
    publisher = rospy.Publisher("turtle1/cmd_vel", Twist, queue_size=10)
    print("Reading from keyboard")
    print("---------------------------")
    print("Use arrow keys to move the turtle. 'q' to quit.")
    with raw_keys():
        threading.Thread(target=read_keys, args=(publisher, linear, angular), daemon=True).start()
        rospy.spin()
