import { computed, shallowRef } from "vue";
import { ask } from "../api/ask.ts";
import { leaseId } from "../api/lease.ts";
import type { Action, LeaseView, Me } from "../generated/api.ts";
import { LeaseNeeded } from "../generated/codes.ts";
import { COMMON } from "../words/common.ts";
import { t } from "../words/index.ts";
import { useLoaded } from "./load.ts";
import { can, connection, latestEvent, queue, state } from "./robot.ts";
import { translated } from "./translations.ts";

export const me = shallowRef<Me | null>(null);
export const lease = shallowRef<LeaseView | null>(null);

/** Reads again who this person is and who drives. Commands and jobs hold the lease for their time, without an event. */
export const { read: refresh } = useLoaded(
  async () => {
    [me.value, lease.value] = await Promise.all([ask("GET /v1/me"), ask("GET /v1/lease")]);
  },
  [leaseId, () => state.value?.mode, () => queue.value?.mode, () => queue.value?.running?.id, latestEvent({ kind: "lease" })],
);

/** Returns why an action is not possible now, "" if it is. */
export function whyNot(action: Action): string {
  if (connection.value === "lost") return t(COMMON.offline);
  const notice = can.value?.actions[action];
  if (!notice) return "";
  // on the page a button takes control; the words of the service name a command
  return notice.code === LeaseNeeded ? t(COMMON.controlFirst) : translated(notice.message);
}

/** Whether this tab may drive: it holds the lease, or nobody needs one. */
export const drives = computed(() => lease.value?.yours ?? false);

/** Whether this person is an operator or an administrator, who may offer control to others. */
export const operates = computed(() => me.value !== null && ["operator", "admin"].includes(me.value.role));
