import { ref, shallowRef } from "vue";
import type { StopReport } from "../generated/api.ts";
import { live, stream } from "../state/robot.ts";
import { overHttp } from "./ask.ts";

/** The progress of the latest stop, for the button and for screen readers. */
export const stopping = ref<"idle" | "sent" | "done" | "failed">("idle");
export const stopReport = shallowRef<StopReport | null>(null);
export const stopFailure = ref("");

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
  try {
    stopReport.value = (await Promise.any(ways)) as StopReport;
    stopping.value = "done";
  } catch (failure) {
    const first: unknown = failure instanceof AggregateError ? failure.errors[0] : failure;
    stopFailure.value = first instanceof Error ? first.message : String(first);
    stopping.value = "failed";
  }
}
