import { defineAsyncComponent, watch, type Component } from "vue";
import { connection } from "../state/robot.ts";
import NotLoaded from "./NotLoaded.vue";

const ATTEMPTS = 3;
const PAUSE = 500;

/**
 * Returns a part of the page whose files are loaded when it is first shown. While the service is gone, the part waits for
 * its return. If the service does not have the files, the page says so.
 */
export function lazy(load: () => Promise<{ default: Component }>): Component {
  return defineAsyncComponent({
    loader: load,
    errorComponent: NotLoaded,
    onError(_error, retry, fail, attempts) {
      if (connection.value === "live") {
        if (attempts < ATTEMPTS) setTimeout(retry, PAUSE);
        else fail();
        return;
      }
      const end = watch(connection, (now) => {
        if (now !== "live") return;
        end();
        retry();
      });
    },
  });
}
