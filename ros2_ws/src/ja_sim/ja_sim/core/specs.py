"""The parts of a world: frozen, validated descriptions of head, caregiver, objects and room.

The defaults are the geometry in which all figures are measured. Angles are in degrees here because
people write them; the code computes in radians.
"""

from __future__ import annotations

from dataclasses import dataclass

from ja_common.core.config import ConfigError, Configuration, interval_parameter, parameter


@dataclass(frozen=True)
class HeadSpec(Configuration):
    """The robot's head: servos, encoders and camera. The defaults are the *ideal* head."""

    pan_limit_deg: float = parameter(60.0, 'Largest pan to either side', low=1.0, high=170.0)
    tilt_limit_deg: float = parameter(30.0, 'Largest tilt up or down', low=1.0, high=80.0)
    servo_frequency_rad_s: float = parameter(
        150.0, 'Natural frequency of the critically damped servos', low=1.0, high=300.0
    )
    speed_limit_deg_s: float = parameter(
        0.0, 'Speed of the motors without load; 0 for no limit', low=0.0, high=3000.0
    )
    acceleration_limit_deg_s2: float = parameter(
        0.0, 'Acceleration at stall torque; 0 for no limit', low=0.0, high=1e5
    )
    dead_time_s: float = parameter(0.0, 'From command to torque', low=0.0, high=0.5)
    backlash_deg: float = parameter(
        0.0, 'Play between motor and camera, from end to end', low=0.0, high=10.0
    )
    encoder_noise_deg: float = parameter(0.0, 'Standard deviation of a reading', low=0.0, high=5.0)
    encoder_step_deg: float = parameter(0.0, 'Resolution of a reading', low=0.0, high=5.0)
    encoder_delay_s: float = parameter(0.0, 'Age of a reading', low=0.0, high=0.5)
    view_pan_deg: float = parameter(18.0, 'Half the width of the view', low=2.0, high=60.0)
    view_tilt_deg: float = parameter(13.5, 'Half the height of the view', low=2.0, high=60.0)
    camera_rate_hz: float = parameter(
        0.0,
        'Rate of the free-running camera; 0 exposes at the end of each step',
        low=0.0,
        high=240.0,
    )
    camera_latency_s: float = parameter(
        0.0, 'From exposure to the picture; needs a camera_rate_hz', low=0.0, high=0.5
    )
    exposure_time_s: float = parameter(
        0.0, 'Time during which movement smears the picture', low=0.0, high=0.1
    )
    exposure_gain: float = parameter(1.0, 'Brightness of the picture', low=0.2, high=3.0)
    image_noise: float = parameter(
        0.0, 'Standard deviation of a pixel in grey levels', low=0.0, high=50.0
    )

    def check_together(self) -> None:
        """Raise ConfigError for a latency without a camera rate."""
        if self.camera_latency_s > 0.0 and self.camera_rate_hz == 0.0:
            raise ConfigError(
                f'camera_latency_s = {self.camera_latency_s} needs a camera_rate_hz above 0'
            )


HEAD_PRESETS = {
    'ideal': HeadSpec(),
    'hobby_servo': HeadSpec(
        servo_frequency_rad_s=30.0,
        speed_limit_deg_s=400.0,
        acceleration_limit_deg_s2=8000.0,
        dead_time_s=0.02,
        backlash_deg=1.0,
        encoder_noise_deg=0.1,
        encoder_step_deg=0.29,
        encoder_delay_s=0.01,
        camera_rate_hz=30.0,
        camera_latency_s=0.03,
        exposure_time_s=0.008,
        image_noise=3.0,
    ),
}


@dataclass(frozen=True)
class CaregiverSpec(Configuration):
    """Who she is, where she sits and how she behaves."""

    identity: str = parameter('any', "A name in the asset, or 'any': drawn at each reset")
    photo: str = parameter(
        '', 'File (.npz) with a head made from a photograph, which then plays her; empty for none'
    )
    distance_m: float = parameter(1.2, 'From the robot to her face', low=0.6, high=4.0)
    pan_deg: float = parameter(0.0, 'Where her face is', low=-60.0, high=60.0)
    tilt_deg: float = parameter(0.0, 'Where her face is', low=-20.0, high=20.0)
    head_share: tuple[float, float] = interval_parameter(
        (0.6, 0.9), 'Part of the gaze angle that her head takes, drawn per look', 0.0, 1.0
    )
    head_noise_deg: float = parameter(
        1.0, "Standard deviation of her head's angles", low=0.0, high=15.0
    )
    gaze_noise_deg: float = parameter(
        0.7,
        'Standard deviation, in pan and in tilt, of how far her eyes miss what she looks at',
        low=0.0,
        high=15.0,
    )
    reliability: float = parameter(
        1.0, 'Share of looks that go where she attends; others go anywhere', low=0.0, high=1.0
    )
    reaction_s: float = parameter(
        0.2, 'From being looked at to the start of her movement', low=0.0, high=5.0
    )
    turn_s: float = parameter(0.3, 'Time her head takes to turn', low=0.01, high=5.0)
    attention_s: float = parameter(
        10.0, 'How long she attends while the robot looks elsewhere', low=0.1, high=3600.0
    )
    patience_s: float = parameter(
        4.0, 'How long she attends while the robot keeps staring at her', low=0.1, high=3600.0
    )
    eye_contact_deg: float = parameter(
        4.0, 'The robot looks at her within this angle of her face', low=0.1, high=20.0
    )
    eye_contact_speed_deg_s: float = parameter(
        10.0, 'and while its head turns slower than this', low=0.1, high=500.0
    )
    blink_rate_hz: float = parameter(0.1, 'Mean rate of blinks', low=0.0, high=2.0)
    shows_object: str = parameter(
        'no', 'What she does with the object she attends to', choices=('no', 'shakes', 'holds')
    )


@dataclass(frozen=True)
class ObjectsSpec(Configuration):
    """The objects on and above the table, relative to the robot's head."""

    count: int = parameter(5, 'How many', low=1, high=10)
    pan_deg: tuple[float, float] = interval_parameter(
        (-40.0, 40.0), 'Where they may be', -90.0, 90.0
    )
    tilt_deg: tuple[float, float] = interval_parameter(
        (-15.0, 15.0), 'Where they may be', -45.0, 45.0
    )
    distance_m: tuple[float, float] = interval_parameter(
        (0.6, 1.0), 'How far they may be', 0.2, 3.0
    )
    radius_m: tuple[float, float] = interval_parameter(
        (0.02, 0.035), 'How large they are', 0.005, 0.2
    )
    gap_to_face_deg: float = parameter(
        8.0, 'Least angle between an object and her face', low=0.0, high=40.0
    )
    gap_deg: float = parameter(5.0, 'Least angle between two objects', low=0.0, high=40.0)
    moving_share: float = parameter(0.0, 'Share of objects that move', low=0.0, high=1.0)
    rearranged: str = parameter(
        'replaced',
        'What happens to them when the robot looks at her again',
        choices=('never', 'moved', 'replaced'),
    )


@dataclass(frozen=True)
class RoomSpec(Configuration):
    """The room and its light."""

    furnished: bool = parameter(True, 'With furniture and clutter, or walls and table only')
    light_variation: float = parameter(0.5, 'How differently each reset is lit', low=0.0, high=1.0)


@dataclass(frozen=True)
class SensesSpec(Configuration):
    """What the robot's head carries beside its camera: nothing by default.

    The depth sensor is a pair of imagers with matching, as in structured-light and stereo cameras:
    `core.depth_sensor`. Its errors are stated in disparity, of which depth is the inverse. The
    defaults are those of a RealSense D435 at 848x480.
    """

    depth: str = parameter(
        'none',
        'Depth pictures: none, with the errors of a real sensor, or as the world is',
        choices=('none', 'sensor', 'exact'),
    )
    depth_range_m: tuple[float, float] = interval_parameter(
        (0.25, 4.0), 'Nearest and farthest depth that is measured', 0.02, 8.0
    )
    depth_baseline_m: float = parameter(
        0.05, 'Between the two imagers of the depth sensor', low=0.005, high=0.5
    )
    depth_focal_px: float = parameter(
        617.0, "Focal length of the depth sensor, in its own imager's pixels", low=50.0, high=1e4
    )
    disparity_noise_px: float = parameter(
        0.1, 'Standard deviation of a disparity', low=0.0, high=5.0
    )
    disparity_step_px: float = parameter(
        0.03125, 'Resolution of a disparity; 0 for none', low=0.0, high=2.0
    )
    matching_window_px: float = parameter(
        5.0, 'Width over which errors of neighbouring pixels are alike', low=0.0, high=50.0
    )
    grazing_deg: float = parameter(
        80.0, 'Surfaces turned away by more than this give no depth', low=10.0, high=90.0
    )
    depth_scale_deviation: float = parameter(
        0.01,
        'Standard deviation of the relative error that is the same in a whole run (calibration)',
        low=0.0,
        high=0.1,
    )
    second_camera: bool = parameter(False, 'A second camera of the same kind to the right')
    baseline_m: float = parameter(
        0.06, 'From the camera to the second camera', low=0.005, high=0.5
    )
