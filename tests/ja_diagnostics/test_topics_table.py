"""What `./ja topics` shows of a graph."""

import io
import threading

from rclpy.node import Node
from rich.console import Console

from ja_common.executor import CachedWaitSetExecutor
from ja_common.topics import DETECTIONS, FIXATION, SUCCESS_RATE
from ja_diagnostics.topics_table import TopicRow, measure_topics, table_of_topics


def test_a_graph_is_listed_with_rates_and_purposes(ros_context):
    node = Node('talker', context=ros_context, namespace='/robot')
    often = node.create_publisher(DETECTIONS.type, DETECTIONS.name, DETECTIONS.publisher_qos)
    node.create_publisher(SUCCESS_RATE.type, SUCCESS_RATE.name, SUCCESS_RATE.publisher_qos)
    node.create_subscription(
        DETECTIONS.type, DETECTIONS.name, lambda _: None, DETECTIONS.subscriber_qos
    )
    node.create_subscription(FIXATION.type, FIXATION.name, lambda _: None, FIXATION.subscriber_qos)
    node.create_timer(0.02, lambda: often.publish(DETECTIONS.type()))
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(node)
    ended = threading.Event()

    def spin():
        while not ended.is_set():
            executor.spin_once(timeout_sec=0.1)

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        rows = {row.name: row for row in measure_topics(1.0)}
    finally:
        ended.set()
        thread.join()
        executor.shutdown()
        node.destroy_node()
    detections = rows['/robot/detections']
    assert detections.rate_hz > 0
    assert (detections.type, detections.quality) == ('sensor_msgs/PointCloud2', 'reliable')
    assert detections.publishers == detections.subscribers == ['talker']
    assert detections.purpose == DETECTIONS.purpose
    success = rows['/robot/sim/success_rate']
    assert (success.quality, success.rate_hz) == ('reliable, latched', 0.0)
    assert success.subscribers == []
    assert '/robot/fixation' not in rows, 'no node publishes it'
    assert table_of_topics(list(rows.values())).row_count == len(rows)


def test_a_unit_in_brackets_is_printed():
    row = TopicRow('depth', 'Image', 'reliable', ['sim'], [], 9.5, 'distances, 16UC1 [mm]')
    console = Console(width=200, file=io.StringIO())
    console.print(table_of_topics([row]))
    assert '16UC1 [mm]' in console.file.getvalue()
