import { createApp } from "vue";
import "./look/tokens.css";
import "./look/base.css"; // before the styles of the components, which change it
import App from "./App.vue";
import { followJobs } from "./app/finish.ts";
import { keepFiles } from "./app/install.ts";
import { listenForStop } from "./app/stop-keys.ts";
import { applyTheme } from "./look/theme.ts";
import { redeem, takeCode } from "./state/account.ts";
import { start } from "./state/robot.ts";
import { applyLanguage } from "./words/index.ts";

const code = takeCode();
applyTheme();
applyLanguage();
createApp(App).mount("#app");
if (code) void redeem(code).finally(start);
else start();
addEventListener("load", () => void keepFiles());
listenForStop();
followJobs();
