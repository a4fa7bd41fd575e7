"""The nodes that drive turtles: `draw_square`, `turtle_mimic` and `teleop_turtle`."""

import contextlib
import os
import signal
import termios
import threading
from math import cos, hypot, pi, remainder, sin

import rospy
from geometry_msgs.msg import Twist
from std_srvs.srv import Empty
from turtlesim.msg import Pose

SIDE_M = 2.0
SPEED = 1.0
TURN_SPEED = 0.4
NEAR_M, NEAR_RAD = 0.1, 0.01
STILL = 0.0001
PERIOD_S = 0.016
STDIN = 0
KEYS = {b"A": (1, 0), b"B": (-1, 0), b"C": (0, -1), b"D": (0, 1)}
"""The last byte of what an arrow key sends: forward and turning."""
QUIT = b"q"
SCALE = 2.0


class Square:
    """Forward, stop, turn, stop. `next_command` gives linear and angular velocity for a pose."""

    def __init__(self):
        self._turning = False
        self._stopping = False
        self._goal = None

    def next_command(self, pose):
        if self._goal is None:
            self._aim(pose)
        if self._stopping:
            if pose.linear_velocity < STILL and pose.angular_velocity < STILL:
                rospy.loginfo("Reached goal")
                self._stopping, self._turning = False, not self._turning
                self._aim(pose)
            return 0.0, 0.0
        if self._has_reached(pose):
            self._stopping = True
            return 0.0, 0.0
        return (0.0, TURN_SPEED) if self._turning else (SPEED, 0.0)

    def _aim(self, pose):
        x, y, theta = pose.x, pose.y, pose.theta
        if self._turning:
            theta = remainder(theta + pi / 2, 2 * pi)
        else:
            x, y = x + SIDE_M * cos(theta), y + SIDE_M * sin(theta)
        self._goal = (x, y, theta)
        rospy.loginfo("New goal [%f %f, %f]", *self._goal)

    def _has_reached(self, pose):
        x, y, theta = self._goal
        if self._turning:
            return abs(remainder(pose.theta - theta, 2 * pi)) < NEAR_RAD
        return hypot(pose.x - x, pose.y - y) < NEAR_M


def draw_square():
    """Drive the first turtle along a square of 2 m, again and again."""
    rospy.init_node("draw_square")
    poses = []
    rospy.Subscriber("turtle1/pose", Pose, lambda pose: poses.__setitem__(slice(None), [pose]), queue_size=1)
    publisher = rospy.Publisher("turtle1/cmd_vel", Twist, queue_size=10)
    rospy.wait_for_service("reset")
    rospy.ServiceProxy("reset", Empty)()
    square = Square()

    def drive(_event):
        if poses:
            twist = Twist()
            twist.linear.x, twist.angular.z = square.next_command(poses[0])
            publisher.publish(twist)

    rospy.Timer(rospy.Duration(PERIOD_S), drive)
    rospy.spin()


def mimic():
    """Tell one turtle to do what another one does."""
    rospy.init_node("turtle_mimic")
    given, wanted = rospy.resolve_name("input"), rospy.resolve_name("output")  # launch files remap these two
    publisher = rospy.Publisher(wanted + "/cmd_vel", Twist, queue_size=10)

    def follow(pose):
        twist = Twist()
        twist.linear.x, twist.angular.z = pose.linear_velocity, pose.angular_velocity
        publisher.publish(twist)

    rospy.Subscriber(given + "/pose", Pose, follow, queue_size=1)
    rospy.spin()


@contextlib.contextmanager
def raw_keys():
    """Have keys come as they are pressed, not by line, while the block runs. What is not a terminal is left alone."""
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


def teleop():
    """Turn arrow keys into velocity commands. Without a keyboard, stay up and wait."""
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
