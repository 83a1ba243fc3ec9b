import { computed, ref, type Component } from "vue";
import type { IconName } from "./look/icon-names.ts";
import { lazy } from "./look/lazy.ts";
import Live from "./pages/live/Live.vue";
import { hello } from "./state/robot.ts";
import { COMMON } from "./words/common.ts";
import type { Words } from "./words/index.ts";

export interface Page {
  path: string;
  words: Words;
  icon: IconName;
  view: Component;
  /** Whether the page has a place in the rail and in the tabs of a phone now; without it, always. */
  listed?: () => boolean;
}

/** All pages. The server answers exactly these paths (src/maya_un/dashboard/pages.py). */
export const PAGES: readonly Page[] = [
  { path: "/", words: COMMON.live, icon: "activity", view: Live },
  { path: "/drive", words: COMMON.drive, icon: "move", view: lazy(() => import("./pages/drive/Drive.vue")) },
  { path: "/queue", words: COMMON.queue, icon: "list-ordered", view: lazy(() => import("./pages/queue/Queue.vue")) },
  { path: "/teach", words: COMMON.teach, icon: "graduation-cap", view: lazy(() => import("./pages/teach/Teach.vue")) },
  { path: "/history", words: COMMON.history, icon: "rotate-ccw-clock", view: lazy(() => import("./pages/history/History.vue")) },
  { path: "/workshop", words: COMMON.workshop, icon: "wrench", view: lazy(() => import("./pages/workshop/Workshop.vue")) },
  { path: "/robots", words: COMMON.robots, icon: "bot", view: lazy(() => import("./pages/robots/Robots.vue")), listed: () => hello.value?.fleet === true },
  { path: "/people", words: COMMON.people, icon: "users", view: lazy(() => import("./pages/people/People.vue")) },
];

const path = ref(location.pathname);

/** The query of the address, such as ?job=12; a token is never part of it. */
export const query = ref(new URLSearchParams(location.search));

export const page = computed(() => PAGES.find((one) => one.path === path.value) ?? (PAGES[0] as Page));

/** Returns the address of a page with the keys of its query. */
export function addressOf(to: string, keys: Record<string, string> = {}): string {
  const text = new URLSearchParams(keys).toString();
  return text ? `${to}?${text}` : to;
}

/** Shows a page, with the keys of its query. */
export function go(to: string, keys: Record<string, string> = {}): void {
  history.pushState(null, "", addressOf(to, keys));
  follow();
}

function follow(): void {
  path.value = location.pathname;
  query.value = new URLSearchParams(location.search);
}

addEventListener("popstate", follow);
