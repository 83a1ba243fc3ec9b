import { ref } from "vue";
import type { LeaseTaken } from "../generated/api.ts";

/** The id of the control lease that this tab holds, "" for none. Without users nobody needs one. */
export const leaseId = ref("");

let renewal: ReturnType<typeof setInterval> | undefined;

/** Keeps a lease: renews it on the stream, bound to it, so that it ends when the tab is closed. */
export function keepLease(taken: LeaseTaken, renew: (id: string) => Promise<unknown>): void {
  leaseId.value = taken.id;
  clearInterval(renewal);
  const again = () => void renew(taken.id).catch(() => dropLease(taken.id));
  again();
  renewal = setInterval(again, (taken.expires_in * 1000) / 3);
}

/** Forgets the lease `id`, or any. */
export function dropLease(id = leaseId.value): void {
  if (id !== leaseId.value) return;
  clearInterval(renewal);
  leaseId.value = "";
}
