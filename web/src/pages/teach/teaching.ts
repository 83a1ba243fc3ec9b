import { computed } from "vue";
import { can } from "../../state/robot.ts";
import { translated } from "../../state/translations.ts";

/** Codes below are about the connection and the robot's state, from here on about rights, jobs and requests. */
const FIRST_OF_REQUESTS = 4000;

/** Why this person may not rename, delete or enter places, "" if they may: these need neither robot nor homing. */
export const whyNotEdit = computed(() => {
  const notice = can.value?.actions["teach"];
  return notice && notice.code >= FIRST_OF_REQUESTS ? translated(notice.message) : "";
});
