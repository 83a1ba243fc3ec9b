import { computed, ref, shallowRef, watch } from "vue";
import { ask } from "../api/ask.ts";
import { leaseId } from "../api/lease.ts";
import type { Action, LeaseView, Me } from "../generated/api.ts";
import { translated } from "../words/errors.ts";
import { language } from "../words/index.ts";
import { can, connection, events, queue, state } from "./robot.ts";

export const me = shallowRef<Me | null>(null);
export const lease = shallowRef<LeaseView | null>(null);

const looking = ref(false);
let again = false;

/** Reads again who this person is and who drives; calls that come while it reads are answered by one more reading. */
export async function refresh(): Promise<void> {
  if (looking.value) {
    again = true;
    return;
  }
  looking.value = true;
  try {
    const [caller, holder] = await Promise.all([ask("GET /v1/me"), ask("GET /v1/lease")]);
    me.value = caller;
    lease.value = holder;
  } catch {
    // without a connection the page says so everywhere; the next greeting reads again
  } finally {
    looking.value = false;
    if (again) {
      again = false;
      if (connection.value === "live") void refresh();
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
    () => queue.value?.mode,
    () => queue.value?.running?.id,
    () => events.value.findLast((one) => one.kind === "lease")?.seq,
  ],
  () => connection.value === "live" && void refresh(),
);

/** Returns why an action is not possible now, "" if it is. */
export function whyNot(action: Action): string {
  const notice = can.value?.actions[action];
  return notice ? translated(notice.code, notice.message) : "";
}

/** Whether this tab may drive: it holds the lease, or nobody needs one. */
export const drives = computed(() => lease.value?.yours ?? false);
