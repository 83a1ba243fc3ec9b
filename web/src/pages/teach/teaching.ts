import { computed } from "vue";
import { FIRST_REQUEST } from "../../generated/codes.ts";
import { can } from "../../state/robot.ts";
import { translated } from "../../state/translations.ts";

/** Why this person may not rename, delete or enter places, "" if they may: these need neither robot nor homing. */
export const whyNotEdit = computed(() => {
  const notice = can.value?.actions["teach"];
  return notice && notice.code >= FIRST_REQUEST ? translated(notice.message) : "";
});
