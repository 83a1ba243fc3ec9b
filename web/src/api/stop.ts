import type { StopReport } from "../generated/api.ts";
import { failureOf } from "../state/act.ts";
import { live, onState, state, stream } from "../state/robot.ts";
import { COMMON } from "../words/common.ts";
import { t } from "../words/index.ts";
import { overHttp, Unreachable } from "./ask.ts";
import { Stopping } from "./stopping.ts";

const newest = new Stopping(() => state.value);
onState(() => newest.look());

/** The progress of the newest stop, for the button and for screen readers. */
export const { stage: stopping, report: stopReport, failure: stopFailure } = newest;

const beforeStop = new Set<() => void>();

/** Calls `action` before every stop, for example to end a held jog. Returns the function that ends this. */
export function onStop(action: () => void): () => void {
  beforeStop.add(action);
  return () => beforeStop.delete(action);
}

/**
 * Stops the robot. The request goes over HTTP and on the stream at once, and the first answer counts: a browser's six
 * connections may all be busy, and the stream may just be breaking.
 */
export function stop(): Promise<void> {
  for (const action of beforeStop) action();
  const ways = [overHttp("POST", "/v1/stop", "", true)];
  if (live.value) ways.push(stream.request("POST", "/v1/stop"));
  return newest.follow(ways as Promise<StopReport>[], reasonOf);
}

function reasonOf(error: unknown): string {
  return error instanceof Unreachable ? t(COMMON.noAnswer) : failureOf(error).message;
}
