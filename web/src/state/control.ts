import { ask } from "../api/ask.ts";
import { dropLease, keepLease } from "../api/lease.ts";
import type { Taking } from "../generated/api.ts";
import { refresh } from "./can.ts";
import { stream } from "./robot.ts";

/** Takes the control lease for this tab, and keeps it until the tab is closed; throws `Refusal`. */
export async function takeControl(body: Taking = {}): Promise<void> {
  const taken = await ask("POST /v1/lease", { body });
  keepLease(taken, (id) => stream.ask({ type: "renew", lease: id, bound: true }));
  await refresh();
}

/** Releases the control lease of this tab. */
export async function releaseControl(): Promise<void> {
  try {
    await ask("DELETE /v1/lease");
  } finally {
    dropLease();
    await refresh();
  }
}
