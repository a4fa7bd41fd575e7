"""The node `robot_world`: what the robot and its laser say and hear over ROS."""

import math
import random
import threading
import time

import rospy
import yaml
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import Point, Pose, Quaternion, TransformStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from rospkg import ResourceNotFound, RosPack
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, ColorRGBA, Header
from world import STEP_S, Laser, Robot, read_plan, walls_of

QUEUE = 10
RULE = "\n" + 80 * "=" + "\nMSG: "
STILL_S = 1.0
CATCH_UP_STEPS = 2000
LINE_LIST = 5
# The package visualization_msgs may be missing, and checks read the walls from such a message.
MARKER = """uint8 ARROW=0
uint8 CUBE=1
uint8 SPHERE=2
uint8 CYLINDER=3
uint8 LINE_STRIP=4
uint8 LINE_LIST=5
uint8 CUBE_LIST=6
uint8 SPHERE_LIST=7
uint8 POINTS=8
uint8 TEXT_VIEW_FACING=9
uint8 MESH_RESOURCE=10
uint8 TRIANGLE_LIST=11
uint8 ADD=0
uint8 MODIFY=0
uint8 DELETE=2
uint8 DELETEALL=3
Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string text
string mesh_resource
bool mesh_use_embedded_materials"""

ROBOTS = {
    "turtlebot3": {
        "radius": 0.105,
        "max_linear": 0.22,
        "max_angular": 2.84,
        "samples": 360,
        "angle_min": 0.0,
        "angle_max": 2 * math.pi,
        "range_min": 0.12,
        "range_max": 3.5,
        "scan_hz": 10.0,
        "laser_x": -0.032,
        "scan_topic": "scan",
        "laser_frame": "base_scan",
    },
    "stage": {
        "radius": 0.18,
        "max_linear": 1.0,
        "max_angular": 2.0,
        "samples": 271,
        "angle_min": math.radians(-135),
        "angle_max": math.radians(135),
        "range_min": 0.0,
        "range_max": 30.0,
        "scan_hz": 10.0,
        "laser_x": 0.05,
        "scan_topic": "base_scan",
        "laser_frame": "base_laser_link",
    },
}
SHARED = {"odom_hz": 20.0, "noise": 0.0, "seed": 0, "cmd_vel_timeout": 0.0, "start": [0.0, 0.0, 0.0]}
TREMOR = 1e-5
"""In odometry, metres and radians: Gazebo's robot is never exactly where it began, and nodes that work there may rely
on that (`if yaw > start_yaw`)."""


class Every:
    """Says in which steps something is due, `hz` times a second."""

    def __init__(self, hz):
        self._steps = max(1, round(1 / (hz * STEP_S)))

    def due(self, step):
        return step % self._steps == 0


class World:
    def __init__(self):
        rospy.init_node("robot_world")
        about = _settings()
        walls = _walls()
        self._lock = threading.Lock()
        fastest = (about["max_linear"], about["max_angular"])
        self._start = tuple(float(value) for value in about["start"])
        self._robot = Robot(walls, about["radius"], self._start, fastest, about["cmd_vel_timeout"])
        angles = (about["angle_min"], about["angle_max"], int(about["samples"]))
        chance = random.Random(about["seed"])  # noqa: S311 - noise, and the same in each run
        bounds = (about["range_min"], about["range_max"])
        self._laser = Laser(walls, angles, bounds, about["noise"], chance)
        self._tremor = random.Random(about["seed"])  # noqa: S311 - as above
        self._about = about
        self._scan_due, self._odom_due = Every(about["scan_hz"]), Every(about["odom_hz"])
        self._steps = 0
        self._hit = False
        self._advertise(walls)
        rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=1)
        rospy.loginfo("A robot like %s at %s, %d walls", about["robot"], list(self._start), len(walls))

    def _advertise(self, walls):
        tf_message = _generate_class(
            "tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms", TransformStamped
        )
        marker = _generate_class("visualization_msgs/Marker", MARKER, Header, Pose, Vector3, ColorRGBA)
        self._odom = rospy.Publisher("odom", Odometry, queue_size=QUEUE)
        self._truth = rospy.Publisher("base_pose_ground_truth", Odometry, queue_size=QUEUE)
        self._scan = rospy.Publisher(self._about["scan_topic"], LaserScan, queue_size=QUEUE)
        self._collision = rospy.Publisher("collision", Bool, queue_size=QUEUE, latch=True)
        self._tf = rospy.Publisher("/tf", tf_message, queue_size=QUEUE)
        self._tf_static = rospy.Publisher("/tf_static", tf_message, queue_size=1, latch=True)
        self._shown = rospy.Publisher("~walls", marker, queue_size=1, latch=True)
        self._tf_type = tf_message
        laser = (self._about["laser_x"], 0.0, 0.0)
        base = _transform("base_footprint", "base_link", (0.0, 0.0, 0.0), rospy.Time())
        self._tf_static.publish(
            tf_message([base, _transform("base_link", self._about["laser_frame"], laser, rospy.Time())])
        )
        self._collision.publish(False)
        picture = marker(type=LINE_LIST, points=[Point(x, y, 0.0) for wall in walls for x, y in wall])
        picture.header.frame_id, picture.ns = "map", "walls"
        picture.scale.x, picture.color.a, picture.pose.orientation.w = 0.02, 1.0, 1.0
        self._shown.publish(picture)

    def run(self):
        """Move the robot until the node is shut down. Steps are counted by ROS's clock, so the world is as fast as
        that."""
        simulated = not rospy.rostime.is_wallclock()
        began_s = None
        while not rospy.is_shutdown():
            now_s = rospy.get_time() if simulated else time.monotonic()
            # With /use_sim_time, the time is 0 until a first message of /clock comes.
            if began_s is None and now_s:
                began_s = now_s
            if began_s is not None:
                # The small number makes up for what float sums fall short of a whole step.
                due = int((now_s - began_s) / STEP_S + 1e-6) - self._steps
                for _ in range(min(due, CATCH_UP_STEPS)):
                    self._step(
                        rospy.Time.from_sec(began_s + (self._steps + 1) * STEP_S)
                        if simulated
                        else rospy.Time.now()
                    )
            if simulated:
                _await_tick(now_s, STILL_S)
            else:
                time.sleep(STEP_S)

    def _step(self, stamp):
        with self._lock:
            self._robot.step()
        self._steps += 1
        robot = self._robot
        # Once for each collision, not in each step of 10 ms.
        if robot.hits != self._hit:
            self._hit = robot.hits
            self._collision.publish(self._hit)
            if self._hit:
                rospy.logwarn("The robot ran into a wall at x=%.2f, y=%.2f", robot.x, robot.y)
        if self._odom_due.due(self._steps):
            self._say_where(stamp)
        if self._scan_due.due(self._steps):
            self._look(stamp)

    def _say_where(self, stamp):
        robot = self._robot
        (x0, y0, theta0), speed = self._start, (robot.forward, robot.turning)
        ahead, aside = robot.x - x0, robot.y - y0
        cos, sin = math.cos(theta0), math.sin(theta0)
        exact = (ahead * cos + aside * sin, aside * cos - ahead * sin, robot.theta - theta0)
        since_start = tuple(self._tremor.gauss(value, TREMOR) for value in exact)
        self._odom.publish(_odometry("odom", since_start, speed, stamp))
        self._truth.publish(_odometry("map", (robot.x, robot.y, robot.theta), speed, stamp))
        self._tf.publish(self._tf_type([_transform("odom", "base_footprint", since_start, stamp)]))

    def _look(self, stamp):
        robot, about, laser = self._robot, self._about, self._laser
        x = robot.x + about["laser_x"] * math.cos(robot.theta)
        y = robot.y + about["laser_x"] * math.sin(robot.theta)
        scan = LaserScan(
            angle_min=laser.low,
            angle_max=laser.high,
            angle_increment=laser.increment,
            scan_time=1 / about["scan_hz"],
            range_min=laser.least,
            range_max=laser.reach,
            ranges=laser.scan(x, y, robot.theta),
        )
        scan.header.stamp, scan.header.frame_id = stamp, about["laser_frame"]
        self._scan.publish(scan)

    def _on_command(self, twist):
        try:
            with self._lock:
                self._robot.command(twist.linear.x, twist.angular.z)
        except ValueError as error:
            rospy.logwarn("cmd_vel is passed over: %s", error)


def _settings():
    """Return the private parameters, and for those that are not set what the robot of that name has."""
    name = rospy.get_param("~robot", "turtlebot3")
    if name not in ROBOTS:
        raise ValueError(f"robot: {name}, but there is {', '.join(sorted(ROBOTS))}")
    about = {**SHARED, **ROBOTS[name], "robot": name}
    return {key: rospy.get_param("~" + key, value) for key, value in about.items()}


def _walls():
    """Return the walls of the parameters `walls`, `boxes` and `map`; `map` is a file's path or `package://<package>/<path>`."""
    walls = walls_of(rospy.get_param("~walls", []), rospy.get_param("~boxes", []))
    path = rospy.get_param("~map", "")
    if path.startswith("package://"):
        package, _, inside = path[len("package://") :].partition("/")
        path = f"{RosPack().get_path(package)}/{inside}"
    return walls + (read_plan(path, yaml.safe_load) if path else [])


def _generate_class(name, text, *parts):
    """Return the class of a message whose package a machine may lack, made of its definition and those of its parts."""
    named = [f"{part._type}\n{part._full_text}" for part in parts]  # noqa: SLF001 - genpy's own names
    return generate_dynamic(name, RULE.join([text, *named]))[name]


def _odometry(frame, pose, speed, stamp):
    x, y, theta = pose
    odometry = Odometry(child_frame_id="base_footprint")
    odometry.header.stamp, odometry.header.frame_id = stamp, frame
    odometry.pose.pose = Pose(Point(x, y, 0.0), _quaternion(theta))
    odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = speed
    return odometry


def _transform(parent, child, pose, stamp):
    x, y, theta = pose
    one = TransformStamped(child_frame_id=child)
    one.header.stamp, one.header.frame_id = stamp, parent
    one.transform.translation, one.transform.rotation = Vector3(x, y, 0.0), _quaternion(theta)
    return one


def _quaternion(theta):
    return Quaternion(0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2))


def _await_tick(seen_s, patience_s):
    """Wait until the simulated clock is no longer where it was seen, or for `patience_s` by the wall's clock."""
    ticked = rospy.rostime.get_rostime_cond()
    with ticked:
        if rospy.get_time() == seen_s:
            ticked.wait(patience_s)


def main():
    try:
        world = World()
    except (ValueError, OSError, ResourceNotFound, yaml.YAMLError) as error:
        rospy.logfatal("%s", error)
        raise SystemExit(1) from error
    world.run()
