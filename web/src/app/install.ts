import { shallowRef } from "vue";

/** The browser's offer to install the page as an app; not all browsers make one. */
interface InstallOffer extends Event {
  prompt(): Promise<unknown>;
}

/** The present offer, null without one. */
export const installer = shallowRef<InstallOffer | null>(null);

addEventListener("beforeinstallprompt", (event) => {
  event.preventDefault();
  installer.value = event as InstallOffer;
});
addEventListener("appinstalled", () => (installer.value = null));

/** Asks the browser to install the page as an app. */
export async function install(): Promise<void> {
  await installer.value?.prompt();
  installer.value = null;
}

/** Keeps the files of the page for the time when the service is down; only https and loopback allow this. */
export async function keepFiles(): Promise<void> {
  if (!("serviceWorker" in navigator) || !import.meta.env.PROD) return;
  try {
    await navigator.serviceWorker.register("/worker.js");
  } catch {
    // the page works without it, but does not open while the service is down
  }
}
