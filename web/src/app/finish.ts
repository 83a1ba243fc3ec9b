import { computed, ref, watch } from "vue";
import { STATES } from "../generated/vocabulary.ts";
import { fixed } from "../look/units.ts";
import { forBrowser } from "../state/kept.ts";
import { events } from "../state/robot.ts";
import { running, share } from "../state/running.ts";
import { t } from "../words/index.ts";

/** Shows the running job to a person who looks elsewhere: its progress in the title of the page, and a notification of its end. */
const KEY = "maya.notify";
const ENDS = ["done", "failed", "interrupted", "cancelled"] as const;

function permission(): NotificationPermission {
  return "Notification" in window ? Notification.permission : "denied";
}

/** Whether the browser forbids notifications: without an encrypted address, or because the person refused them. */
export const forbidden = ref(permission() === "denied");

/** Whether this person wants a notification at the end of a job. */
export const notifies = ref(forBrowser.get(KEY) === "on" && permission() === "granted");

/** Switches notifications. Only this asks the browser for its permission. */
export async function swapNotifies(): Promise<void> {
  const wanted = !notifies.value && (await Notification.requestPermission()) === "granted";
  forbidden.value = permission() === "denied";
  notifies.value = wanted;
  forBrowser.set(KEY, wanted ? "on" : "off");
}

/** How a job ended while nobody saw the page. */
const ended = ref("");

const title = computed(() => [ended.value || (running.value ? `${fixed(share.value * 100, 0)} %` : ""), "Maya"].filter(Boolean).join(" · "));

async function notify(body: string, job: number): Promise<void> {
  const options = { body, icon: "/maya.svg", tag: `maya ${job}` };
  const worker = await navigator.serviceWorker?.getRegistration(); // phones allow no other way
  if (worker) await worker.showNotification("Maya", options);
  else new Notification("Maya", options);
}

/** Follows jobs from now on. */
export function followJobs(): void {
  const seen = new Set<number>();
  let last = 0;
  watch(title, (now) => (document.title = now), { immediate: true });
  watch(() => running.value?.id, (id) => id !== undefined && seen.add(id), { immediate: true });
  watch(events, (all) => {
    const newest = all.at(-1)?.seq ?? 0;
    const fresh = all.filter((one) => one.kind === "job" && (newest < last || one.seq > last));
    last = newest;
    for (const { detail } of fresh) {
      const state = ENDS.find((one) => one === detail["state"]);
      const job = Number(detail["job"]);
      if (detail["state"] === "running") seen.add(job);
      if (state === undefined || !seen.delete(job) || !document.hidden) continue;
      ended.value = `${detail["name"] || `#${job}`}: ${t(STATES[state])}`;
      if (notifies.value) void notify(ended.value, job).catch(() => undefined); // the title says it too
    }
  });
  document.addEventListener("visibilitychange", () => document.hidden || (ended.value = ""));
}
