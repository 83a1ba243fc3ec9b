import { ref, shallowRef } from "vue";
import type { StopReport } from "../generated/api.ts";
import { failureOf } from "../state/act.ts";
import { live, stream } from "../state/robot.ts";
import { COMMON } from "../words/common.ts";
import { t } from "../words/index.ts";
import { overHttp, Unreachable } from "./ask.ts";

/** The progress of the latest stop, for the button and for screen readers. */
export const stopping = ref<"idle" | "sent" | "done" | "failed">("idle");
export const stopReport = shallowRef<StopReport | null>(null);
export const stopFailure = ref("");

/** A stop that is not answered within this time has failed for the person who waits [ms]; it may still arrive. */
const PATIENCE = 5_000;

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
export async function stop(): Promise<void> {
  for (const action of beforeStop) action();
  stopping.value = "sent";
  const ways: Promise<unknown>[] = [overHttp("POST", "/v1/stop", "", true)];
  if (live.value) ways.push(stream.request("POST", "/v1/stop"));
  const late = new Promise<never>((_, reject) => setTimeout(() => reject(new Unreachable()), PATIENCE));
  try {
    stopReport.value = (await Promise.race([Promise.any(ways), late])) as StopReport;
    stopping.value = "done";
  } catch (failure) {
    const first: unknown = failure instanceof AggregateError ? failure.errors[0] : failure;
    stopFailure.value = first instanceof Unreachable ? t(COMMON.noAnswer) : failureOf(first).message;
    stopping.value = "failed";
  }
}
