import type { Config } from "../../generated/api.ts";
import { SIGNALS } from "../../words/workshop.ts";
import type { Words } from "../../words/index.ts";

/** Returns what the configuration says about each digital output, by its number. */
export function outputNames(config: Config | null): Record<number, Words[]> {
  const found: Record<number, Words[]> = {};
  if (config === null) return found;
  const closed = config.gripper.closed_by === "set" ? SIGNALS.gripperSet : SIGNALS.gripperClear;
  found[config.gripper.output] = [closed];
  for (const number of config.controller.outputs) (found[number] ??= []).push(SIGNALS.forPrimitives);
  return found;
}
