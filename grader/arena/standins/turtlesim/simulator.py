"""The node `turtlesim`: what the simulator says and hears over ROS."""

import threading
import time

import rospy
from field import STEP_S, Background, Pace, World
from geometry_msgs.msg import Twist
from rosgraph.names import is_legal_name
from std_srvs.srv import Empty, EmptyResponse
from turtlesim import srv
from turtlesim.msg import Color, Pose

QUEUE = 10


class Params:
    has = staticmethod(rospy.has_param)
    set = staticmethod(rospy.set_param)

    @staticmethod
    def get(name):
        return rospy.get_param(name, None)


class Endpoints:
    """The topics and services of one turtle."""

    def __init__(self, name, turtle, lock):
        self.turtle = turtle
        self._lock = lock
        name = rospy.resolve_name(name)
        self.pose = rospy.Publisher(name + "/pose", Pose, queue_size=QUEUE)
        self.color = rospy.Publisher(name + "/color_sensor", Color, queue_size=QUEUE)
        self._command = rospy.Subscriber(name + "/cmd_vel", Twist, self._on_command, queue_size=1)
        handlers = {
            "set_pen": (srv.SetPen, self._on_pen),
            "teleport_relative": (srv.TeleportRelative, self._on_relative),
            "teleport_absolute": (srv.TeleportAbsolute, self._on_absolute),
        }
        self._services = [
            rospy.Service(f"{name}/{service}", type_, handler)
            for service, (type_, handler) in handlers.items()
        ]

    def close(self):
        for topic in (self._command, self.pose, self.color):
            topic.unregister()
        for service in self._services:
            service.shutdown("the turtle is gone")

    def _on_command(self, twist):
        try:
            with self._lock:
                self.turtle.command(twist.linear.x, twist.linear.y, twist.angular.z)
        except ValueError as error:
            rospy.logwarn("cmd_vel is passed over: %s", error)

    def _on_pen(self, request):
        with self._lock:
            self.turtle.set_pen((request.r, request.g, request.b), request.width, off=bool(request.off))
        return srv.SetPenResponse()

    def _on_relative(self, request):
        self._teleport(self.turtle.teleport_by, request.linear, request.angular)
        return srv.TeleportRelativeResponse()

    def _on_absolute(self, request):
        self._teleport(self.turtle.teleport_to, request.x, request.y, request.theta)
        return srv.TeleportAbsoluteResponse()

    def _teleport(self, teleport, *where):
        try:
            with self._lock:
                teleport(*where)
        except ValueError as error:
            raise rospy.ServiceException(str(error)) from error


class Simulator:
    def __init__(self):
        rospy.init_node("turtlesim")
        self._lock = threading.RLock()
        self._world = World()
        self._endpoints = {}
        self._background = Background(Params)
        self._world.canvas.fill(self._background.read())
        self._one_at_a_time = threading.Lock()
        rospy.loginfo("Starting turtlesim with node name %s", rospy.get_name())
        self._appear(self._world.reset())
        # Not before the turtle is there: a reset that comes in before would make it a second time.
        self._offer("clear", Empty, self._on_clear)
        self._offer("reset", Empty, self._on_reset)
        self._offer("spawn", srv.Spawn, self._on_spawn)
        self._offer("kill", srv.Kill, self._on_kill)

    def run(self):
        """Move the turtles until the node is shut down."""
        pace = Pace(STEP_S)
        simulated = not rospy.rostime.is_wallclock()
        next_s = time.monotonic()
        while not rospy.is_shutdown():
            now_s = time.monotonic()
            for _ in range(pace.due(rospy.get_time() if simulated else now_s, now_s)):
                self._step()
            # A step that was late is not followed by hurried ones: `Pace` counts those that are due.
            next_s = max(next_s + STEP_S, now_s)
            pause_s = next_s - time.monotonic()
            if simulated:
                _await_tick(STEP_S)
            elif pause_s > 0:
                time.sleep(pause_s)

    def _offer(self, name, type_, handler):
        def handle(request):
            with self._one_at_a_time:
                return handler(request)

        rospy.Service(name, type_, handle)

    def _step(self):
        with self._lock:
            for name, turtle in sorted(self._world.turtles.items()):
                color = turtle.step(self._world.canvas)
                if turtle.hit:
                    rospy.logwarn("Oh no! I hit the wall! (Clamping from [x=%f, y=%f])", *turtle.hit)
                endpoints = self._endpoints.get(name)
                if endpoints is not None:
                    endpoints.pose.publish(turtle.x, turtle.y, turtle.theta, turtle.speed, turtle.turning)
                    endpoints.color.publish(*color)

    def _appear(self, name):
        turtle = self._world.turtles[name]
        if name in self._endpoints:  # after a reset: existing connections stay
            self._endpoints[name].turtle = turtle
        else:
            self._endpoints[name] = Endpoints(name, turtle, self._lock)
        where = (turtle.x, turtle.y, turtle.theta)
        rospy.loginfo("Spawning turtle [%s] at x=[%f], y=[%f], theta=[%f]", name, *where)

    def _vanish(self, name):
        with self._lock:
            endpoints = self._endpoints.pop(name)
        endpoints.close()

    def _on_clear(self, _request):
        rospy.loginfo("Clearing turtlesim.")
        self._paint()
        return EmptyResponse()

    def _on_reset(self, _request):
        rospy.loginfo("Resetting turtlesim.")
        with self._lock:
            name = self._world.reset()
        self._appear(name)
        for other in set(self._endpoints) - {name}:
            self._vanish(other)
        self._paint()
        return EmptyResponse()

    def _paint(self):
        color = self._background.read()
        with self._lock:
            self._world.canvas.fill(color)

    def _on_spawn(self, request):
        if request.name and not is_legal_name(request.name):
            rospy.logerr("[%s] is not a name for a turtle", request.name)
            raise rospy.ServiceException(f"no legal name: {request.name}")
        try:
            with self._lock:
                name = self._world.spawn(request.name, request.x, request.y, request.theta)
        except KeyError as error:
            rospy.logerr("A turtle named [%s] already exists", request.name)
            raise rospy.ServiceException("a turtle of that name already exists") from error
        self._appear(name)
        return srv.SpawnResponse(name)

    def _on_kill(self, request):
        try:
            with self._lock:
                self._world.kill(request.name)
        except KeyError as error:
            rospy.logerr("Tried to kill turtle [%s], which does not exist", request.name)
            raise rospy.ServiceException("there is no turtle of that name") from error
        self._vanish(request.name)
        return srv.KillResponse()


def _await_tick(patience_s):
    """Wait until the simulated clock moves, or for `patience_s` by the wall's clock."""
    ticked = rospy.rostime.get_rostime_cond()
    with ticked:
        ticked.wait(patience_s)


def main():
    simulator = Simulator()
    simulator.run()
