"""ROS 2 node that turns the strain of a calibrated finger into a friction coefficient.

It subscribes to ``strain`` (std_msgs/Float64) and publishes ``friction`` (std_msgs/Float64MultiArray: mu, its standard
deviation, and the ends of the 90 % interval); readings that do not determine mu are logged with the reason.  The robot
needs finger3d and NumPy only::

    python3 friction_node.py --ros-args -p calibration:=out/cal/calibration.json
"""

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64, Float64MultiArray

import finger3d.sensor


class FrictionNode(Node):
    """Publishes an estimate for every reading."""

    def __init__(self) -> None:
        """Load the calibration once; an estimate then takes less than a millisecond."""
        super().__init__("friction")
        path = self.declare_parameter("calibration", "calibration.json").value
        self.calibration = finger3d.sensor.load(path)
        self.publisher = self.create_publisher(Float64MultiArray, "friction", 10)
        self.create_subscription(Float64, "strain", self.on_strain, 10)

    def on_strain(self, message: Float64) -> None:
        """Publish mu, or log why the reading does not determine it."""
        found = finger3d.sensor.estimate(self.calibration, message.data)[0]
        if found.is_determined:
            self.publisher.publish(Float64MultiArray(data=[found.mu, found.std, found.low, found.high]))
        else:
            self.get_logger().warning(found.verdict)


def main() -> None:
    """Run the node until it is stopped."""
    rclpy.init()
    rclpy.spin(FrictionNode())


if __name__ == "__main__":
    main()
