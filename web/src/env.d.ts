declare module "virtual:icons" {
  import type { IconName } from "./look/icon-names.ts";
  const shapes: Record<IconName, [tag: string, attributes: Record<string, string>][]>;
  export default shapes;
}
