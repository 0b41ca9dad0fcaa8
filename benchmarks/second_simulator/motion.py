"""Setpoints of the second simulator: random moves as smoothed trapezoids of speed."""

import numpy as np


def trapezoid(distance, speed, acceleration, rate):
    """Speed samples of a rest-to-rest move, exact in its length."""
    speed = min(speed, np.sqrt(abs(distance) * acceleration))
    ramp = max(int(np.ceil(speed / acceleration * rate)), 1)
    hold = int(abs(distance) / speed * rate)
    shape = np.convolve(np.ones(max(hold, 1)), np.ones(ramp)) / ramp
    return shape * distance * rate / shape.sum()


def random_moves(rng, duration, rate, span=0.16, fastest=0.25, acceleration=2.0, smoothing=0.02):
    """(n, 3) position m, speed m/s, acceleration m/s^2: fast and slow moves, tiny ones, rests."""
    place, parts, total = rng.uniform(-0.5, 0.5) * span, [], 0
    start = place
    n = round(duration * rate)
    while total < n:
        kind = rng.choice(3, p=(0.7, 0.2, 0.1))
        if kind == 0:
            target, speed = rng.uniform(-span, span), fastest * rng.uniform(0.1, 1.0)
        elif kind == 1:
            target, speed = place + rng.uniform(-0.01, 0.01), 10.0 ** rng.uniform(-2.7, -1.7)
        else:
            target, speed = place + rng.uniform(-3e-4, 3e-4), 2e-3
        target = np.clip(target, -span, span)
        if abs(target - place) < 1e-5:
            continue
        move = trapezoid(target - place, speed, acceleration * rng.uniform(0.3, 1.0), rate)
        rest = np.zeros(int(rng.uniform(0.03, 0.3) * rate))
        parts += [move, rest]
        total += len(move) + len(rest)
        place = target
    speed = np.concatenate([np.zeros(int(0.1 * rate)), *parts])
    width = max(int(smoothing * rate), 2)
    speed = np.convolve(speed, np.ones(width) / width)[:n]
    step = np.append(np.diff(speed), 0.0)
    position = start + np.cumsum(speed) / rate - 0.5 * speed / rate
    return np.column_stack([position, speed, step * rate])
