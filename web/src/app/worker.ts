/**
 * The service worker: it keeps the page's own files, so that the page opens, and says what is wrong, while the service is
 * down. It answers nothing else: requests to /v1 go to the service as if there were no worker.
 */

/** The files of this build, put in by vite.config.ts: "/" is the document of all pages. */
declare const FILES: readonly string[];
/** A name of this build. */
declare const BUILD: string;

interface Worker extends EventTarget {
  skipWaiting(): Promise<void>;
  readonly location: Location;
  readonly clients: {
    matchAll(of: { type: "window"; includeUncontrolled: boolean }): Promise<{ focus(): Promise<unknown> }[]>;
    openWindow(url: string): Promise<unknown>;
  };
}
interface Extendable extends Event {
  waitUntil(work: Promise<unknown>): void;
}
interface Fetching extends Extendable {
  readonly request: Request;
  respondWith(answer: Promise<Response>): void;
}

interface Clicked extends Extendable {
  readonly notification: Notification;
}

const worker = self as unknown as Worker;
const PREFIX = "maya-";

/** The service has this long to answer with the document before the kept one is shown [ms]. */
const LIMIT = 1500;

worker.addEventListener("install", (event) => {
  (event as Extendable).waitUntil(keep());
});

worker.addEventListener("activate", (event) => {
  (event as Extendable).waitUntil(removeOld());
});

worker.addEventListener("fetch", (event) => {
  const { request } = event as Fetching;
  const { origin, pathname } = new URL(request.url);
  if (request.method !== "GET" || origin !== worker.location.origin) return;
  if (request.mode === "navigate") {
    if (!pathname.startsWith("/v1/") && pathname !== "/metrics") (event as Fetching).respondWith(page(request));
  } else if (pathname.startsWith("/assets/") || (FILES.includes(pathname) && pathname !== "/")) {
    (event as Fetching).respondWith(file(request));
  }
});

/** A click on a notification shows the page. */
worker.addEventListener("notificationclick", (event) => {
  (event as Clicked).notification.close();
  (event as Clicked).waitUntil(showPage());
});

async function showPage(): Promise<void> {
  const [open] = await worker.clients.matchAll({ type: "window", includeUncontrolled: true });
  await (open?.focus() ?? worker.clients.openWindow("/"));
}

/** Keeps the files of this build, and replaces the worker of an older one at once. */
async function keep(): Promise<void> {
  const cache = await caches.open(PREFIX + BUILD);
  await cache.addAll(FILES.map((file) => new Request(file, { credentials: "omit", cache: "no-cache" })));
  await worker.skipWaiting();
}

/** Removes all builds but this one and the one before: a page of that one may still be open. */
async function removeOld(): Promise<void> {
  const old = (await caches.keys()).filter((name) => name.startsWith(PREFIX) && name !== PREFIX + BUILD);
  await Promise.all(old.slice(0, -1).map((name) => caches.delete(name)));
}

/** The document from the service, or the kept one if the service does not answer in time. */
async function page(request: Request): Promise<Response> {
  const kept = async () => (await caches.open(PREFIX + BUILD)).match("/", { ignoreVary: true });
  const late = new Promise<Response | undefined>((resolve) => setTimeout(() => resolve(kept()), LIMIT));
  const asked = fetch(request);
  const found = await Promise.race([asked, late]).catch(kept);
  return found ?? asked;
}

/** A file of this build, or of the one before, which the service may no longer have. */
async function file(request: Request): Promise<Response> {
  const newest = await caches.open(PREFIX + BUILD);
  return (await newest.match(request.url, { ignoreVary: true })) ?? (await caches.match(request.url, { ignoreVary: true })) ?? fetch(request);
}
