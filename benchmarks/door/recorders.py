"""How public recorders name their columns: manuals, exports and logs that were met in the open.

A line is a column: what it holds, its name ({a} is the axis) and, behind a bar, the unit of its
numbers where that is not SI. What a column may hold: see ``recordings.Signals``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """holds: what it holds. name: with {a} for the axis. unit: of its numbers, "" for SI."""

    holds: str
    name: str
    unit: str


@dataclass(frozen=True)
class Recorder:
    """rotary: whether its axes turn, None where either may. axes: what they are called there."""

    name: str
    rotary: bool | None
    axes: tuple[str, ...]
    columns: tuple[Column, ...]


_LISTS: Mapping[str, str] = {
    "TwinCAT Scope | either | X Y": """
        position Axis {a}.NcToPlc.ActPos | mm
        setpoint Axis {a}.NcToPlc.SetPos | mm
        velocity Axis {a}.NcToPlc.ActVelo | mm
        error Axis {a}.NcToPlc.PosDiff | mm
        force Axis {a}.NcToPlc.ActTorque | permille""",
    "TwinCAT, a variable each | straight | 1": """
        position MAIN.stAxis.fActPosition[mm] | mm
        setpoint MAIN.stAxis.fSetPosition[mm] | mm
        current MAIN.stAxis.fActCurrent[A]""",
    "ODrive | turns | 0 1": """
        position axis{a}.encoder.pos_estimate | rev
        velocity axis{a}.encoder.vel_estimate | rev
        setpoint axis{a}.controller.pos_setpoint | rev
        current axis{a}.motor.current_control.Iq_measured
        current_asked axis{a}.motor.current_control.Iq_setpoint
        supply vbus_voltage""",
    "ODrive, logger | turns |": """
        position measured_position_deg | deg
        velocity measured_velocity_deg_s | deg
        force measured_torque_Nm
        current_asked command_current_A
        current measured_current_A
        temperature fet_temp_C""",
    "moteus | turns |": """
        position servo_stats.position | rev
        velocity servo_stats.velocity | rev
        setpoint servo_stats.control_position | rev
        force servo_stats.torque_Nm
        current servo_stats.q_A
        current_d servo_stats.d_A
        supply servo_stats.bus_V
        temperature servo_stats.temp_C""",
    "LinuxCNC halscope | straight | 0 1 2": """
        setpoint joint.{a}.motor-pos-cmd | mm
        position joint.{a}.motor-pos-fb | mm
        error joint.{a}.f-error | mm
        command pid.{a}.output | V""",
    "ROS joint states | turns | elbow wrist shoulder": """
        position /joint_states/{a}/position
        velocity /joint_states/{a}/velocity
        force /joint_states/{a}/effort""",
    "ros2_control | turns | joint_a1 joint_a2": """
        position state_interface.{a}/position
        velocity state_interface.{a}/velocity
        force state_interface.{a}/effort
        setpoint command_interface.{a}/position""",
    "Dynamixel | turns | 1 2": """
        position Present Position {a} | counts
        setpoint Goal Position {a} | counts
        current Present Current {a} | counts""",
    "Universal Robots RTDE | turns | 0 1 2": """
        setpoint target_q_{a}
        setpoint_velocity target_qd_{a}
        acceleration target_qdd_{a}
        position actual_q_{a}
        velocity actual_qd_{a}
        current actual_current_{a}
        temperature joint_temperatures_{a}""",
    "Franka | turns | 0 1 2": """
        position state.q[{a}]
        setpoint state.q_d[{a}]
        velocity state.dq[{a}]
        setpoint_velocity state.dq_d[{a}]
        force state.tau_J[{a}]
        external state.tau_ext_hat_filtered[{a}]""",
    "Unitree | turns | 0 1": """
        position motor_state[{a}].q
        velocity motor_state[{a}].dq
        acceleration motor_state[{a}].ddq
        force motor_state[{a}].tau_est
        temperature motor_state[{a}].temperature""",
    "Siemens Startdrive | turns |": """
        velocity r61[0]: Speed actual value unsmoothed [rpm] | rpm
        position r482[0]: Encoder actual position value Gn_XIST1 | counts
        force r80[0]: Torque actual value [Nm]
        current r78[0]: Current actual value torque-generating [Arms]
        temperature r35: Motor temperature [°C]""",
    "SINUMERIK | straight | X Z": """
        position Lageistwert {a} [mm] | mm
        setpoint Lagesollwert {a} [mm] | mm
        error Schleppabstand {a} [mm] | mm
        current Stromistwert {a} [A]""",
    "TIA technology object | straight |": """
        setpoint PositioningAxis_1.Position [mm] | mm
        position PositioningAxis_1.ActualPosition [mm] | mm
        velocity PositioningAxis_1.ActualVelocity [mm/s] | mm
        force PositioningAxis_1.ActualTorque [Nm] | Nm screw""",
    "Rockwell trend | straight | Axis_X Axis_Y": """
        position {a}.ActualPosition | mm
        setpoint {a}.CommandPosition | mm
        error {a}.PositionError | mm
        force_asked {a}.TorqueReference | percent
        current {a}.CurrentFeedback""",
    "CODESYS trace | straight |": """
        position PLC_PRG.Drive.lrActPosition | mm
        setpoint PLC_PRG.Drive.lrSetPosition | mm
        velocity PLC_PRG.Drive.lrActVelocity | mm
        force PLC_PRG.Drive.lrActForce""",
    "ACS | straight | 0 1": """
        position FPOS({a}) [mm] | mm
        setpoint RPOS({a}) [mm] | mm
        error PE({a}) [mm] | mm
        force DCOM({a}) [%] | percent""",
    "Aerotech | straight | X Y": """
        setpoint PositionCommand({a}) (mm) | mm
        position PositionFeedback({a}) (mm) | mm
        error PositionError({a}) (mm) | mm
        current CurrentFeedback({a}) (A)
        current_asked CurrentCommand({a}) (A)""",
    "Galil | turns | A B": """
        position _TP{a} | counts
        setpoint _RP{a} | counts
        error _TE{a} | counts
        force _TT{a} | V""",
    "Elmo recorder | turns |": """
        position Position [cnt] | counts
        setpoint Position Command [cnt] | counts
        current Active Current [A]
        velocity Velocity [cnt/sec] | counts""",
    "Kollmorgen | turns |": """
        position PL.FB [deg] | deg
        setpoint PL.CMD [deg] | deg
        current IL.FB [Arms]
        current_asked IL.CMD [Arms]""",
    "maxon EPOS | turns |": """
        position Position actual value [inc] | counts
        setpoint Position demand value [inc] | counts
        current Current actual value averaged [mA] | mA
        velocity Velocity actual value averaged [rpm] | rpm""",
    "Yaskawa SigmaWin | turns |": """
        position Feedback position [deg] | deg
        velocity Feedback speed [min-1] | rpm
        setpoint_velocity Reference speed [min-1] | rpm
        force_asked Torque reference [%] | percent""",
    "VESC | turns |": """
        position encoder_position | deg
        velocity erpm | rpm
        current q_axis_current
        current_d d_axis_current
        supply input_voltage
        temperature temp_motor""",
    "ArduPilot CSRV | turns |": """
        position Pos | deg
        force Force
        velocity Speed | deg
        setpoint PosCmd | deg
        supply V""",
    "dSPACE ControlDesk | straight | x y": """
        position Model Root/Stage/Axis_{a}/pos_meas/Out1
        setpoint Model Root/Stage/Axis_{a}/pos_ref/Out1
        force Model Root/Stage/Axis_{a}/F_cmd/Out1""",
    "Simulink | turns |": """
        position q
        setpoint q_ref
        velocity qdot
        force tau""",
    "Quanser | turns |": """
        position theta
        setpoint theta_d
        command Vm | V""",
    "Instron | straight |": """
        position Extension (mm) | mm
        force Load (N)""",
    "Zwick | straight |": """
        position Standardweg [mm] | mm
        force Standardkraft [N]
        temperature Temperatur [°C]""",
    "DIAdem, Portal | straight |": """
        position Istposition [mm] | mm
        setpoint Sollposition [mm] | mm
        velocity Istgeschwindigkeit [mm/s] | mm
        current Motorstrom [A]
        temperature Temperatur [°C]""",
    "German, torque | turns |": """
        position Winkel [°] | deg
        setpoint Winkel Soll [°] | deg
        velocity Drehzahl [1/min] | rpm
        force Drehmoment [Nm]""",
    "French bench | straight |": """
        position Position mesurée (mm) | mm
        setpoint Consigne (mm) | mm
        force Effort (N)
        temperature Température (°C)""",
    "French motor | turns |": """
        position Angle moteur (rad)
        velocity Vitesse (rad/s)
        current Courant (A)
        supply Tension bus (V)""",
    "Chinese servo | straight |": """
        position 实际位置(mm) | mm
        setpoint 指令位置(mm) | mm
        error 位置偏差(mm) | mm
        current 电流(A)
        temperature 温度""",
    "Chinese torque | turns |": """
        position 角度(°) | deg
        velocity 转速(rpm) | rpm
        force 转矩(N·m)""",
    "Japanese servo | straight |": """
        position 現在位置[mm] | mm
        setpoint 指令位置[mm] | mm
        force トルク[%] | percent
        velocity 速度[mm/s] | mm""",
    "Japanese bench | straight |": """
        position 変位[mm] | mm
        force 荷重[N]""",
    "laboratory gantry | straight | x y": """
        position {a}_act
        setpoint {a}_set
        force F{a}""",
    "laboratory, short | straight |": """
        position x
        setpoint xd
        force u""",
    "laboratory, PID | turns |": """
        setpoint pos_cmd
        position pos
        part tau_pid
        feedforward tau_ff
        force tau_total""",
    "laboratory, act and ref | straight |": """
        position act | mm
        setpoint request | mm
        current i""",
    "microcontroller | turns |": """
        position enc_counts | counts
        current_asked iq_set_mA | mA
        current iq_meas_mA | mA""",
    "MuJoCo | turns | 0 1": """
        position qpos_{a}
        velocity qvel_{a}
        force ctrl_{a}""",
    "Copley CME | turns |": """
        position Actual Position (counts) | counts
        setpoint Limited Position (counts) | counts
        current Actual Current (A)
        current_asked Commanded Current (A)""",
    "LeRobot | turns | shoulder_pan elbow_flex": """
        position observation.state.{a}.pos | deg
        setpoint action.{a}.pos | deg""",
    "Heidenhain TNCscope | straight |": """
        position s actual [mm] | mm
        setpoint s nominal [mm] | mm
        velocity v actual [mm/min] | mm/min
        current I nominal [A]""",
    "accelerometer | straight | x y": """
        acceleration accel_{a}""",
}  # fmt: skip


def _read(head: str, text: str) -> Recorder:
    name, turns, axes = (part.strip() for part in head.split("|"))
    columns = []
    for line in text.strip().splitlines():
        named, _, unit = line.strip().partition(" | ")
        holds, _, column = named.partition(" ")
        columns.append(Column(holds, column, unit))
    rotary = {"turns": True, "straight": False}.get(turns)
    return Recorder(name, rotary, tuple(axes.split()) or ("",), tuple(columns))


RECORDERS = tuple(_read(head, text) for head, text in _LISTS.items())
