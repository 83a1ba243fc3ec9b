/** A clock of the robot: at `time` [s] the date was `date`; it runs at `speed` times real time. */
export interface RobotClock {
  time: number;
  date: string;
  speed: number;
}

/** Returns the date at a time of the robot's clock [s]. */
export function dateAt(clock: RobotClock, time: number): Date {
  return new Date(Date.parse(clock.date) + ((time - clock.time) / clock.speed) * 1000);
}
