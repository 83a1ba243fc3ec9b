import { computed, ref, shallowRef, watch } from "vue";
import { ask } from "../api/ask.ts";
import { leaseId } from "../api/lease.ts";
import type { Action, LeaseView, Me, Notice, Status } from "../generated/api.ts";
import { translated } from "../words/errors.ts";
import { language } from "../words/index.ts";
import { connection, events, queue, state } from "./robot.ts";

/** Which actions this person may do now: null, or the reason why not. Empty until the service has told it. */
export const can = shallowRef<Partial<Record<Action, Notice | null>>>({});
export const me = shallowRef<Me | null>(null);
export const lease = shallowRef<LeaseView | null>(null);
export const status = shallowRef<Status | null>(null);

const looking = ref(false);
let again = false;

/** Reads the rights again; calls that come while it reads are answered by one more reading. */
export async function refresh(): Promise<void> {
  if (looking.value) {
    again = true;
    return;
  }
  looking.value = true;
  try {
    const [permissions, caller, holder, now] = await Promise.all([
      ask("GET /v1/me/can"),
      ask("GET /v1/me"),
      ask("GET /v1/lease"),
      ask("GET /v1/status"),
    ]);
    can.value = permissions.actions as typeof can.value;
    me.value = caller;
    lease.value = holder;
    status.value = now;
  } catch {
    // without a connection the page says so everywhere; the next greeting reads again
  } finally {
    looking.value = false;
    if (again) {
      again = false;
      void refresh();
    }
  }
}

watch(
  [
    connection,
    leaseId,
    language,
    () => state.value?.mode,
    () => state.value?.homed,
    () => state.value?.gripper_closed,
    () => queue.value?.mode,
    () => queue.value?.running?.id,
    () => events.value.at(-1)?.kind === "lease" && events.value.at(-1)?.seq,
  ],
  () => connection.value === "live" && void refresh(),
);

/** Returns why an action is not possible now, "" if it is. */
export function whyNot(action: Action): string {
  const notice = can.value[action];
  return notice ? translated(notice.code, notice.message) : "";
}

/** Whether this tab may drive: it holds the lease, or nobody needs one. */
export const drives = computed(() => lease.value?.yours ?? false);
