import shapes from "virtual:icons";
import { h, type FunctionalComponent } from "vue";
import type { IconName } from "./icon-names.ts";

/** An icon of lucide, drawn by render functions: no HTML is parsed at run time. */
const Icon: FunctionalComponent<{ name: IconName; size?: number }> = ({ name, size = 20 }) =>
  h(
    "svg",
    {
      class: "icon",
      width: size,
      height: size,
      viewBox: "0 0 24 24",
      fill: "none",
      stroke: "currentColor",
      "stroke-width": 1.9,
      "stroke-linecap": "round",
      "stroke-linejoin": "round",
      "aria-hidden": "true",
    },
    (shapes[name] ?? []).map(([tag, attributes]) => h(tag, attributes)),
  );

Icon.props = ["name", "size"];
export default Icon;
