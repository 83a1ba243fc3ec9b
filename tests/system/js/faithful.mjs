// Says what it hears on /maya_event, however often the other side is restarted: node faithful.mjs PORT
import { Ros, Topic } from "roslib";

const url = `ws://127.0.0.1:${process.argv[2]}`;
const ros = new Ros({ url });
ros.on("error", () => {});
ros.on("close", () => setTimeout(() => ros.connect(url).catch(() => {}), 100));
const topic = new Topic({ ros, name: "/maya_event", messageType: "std_msgs/String" });
topic.subscribe((message) => console.log("event", message.data.split(" ")[0]));
