// How a page with roslib signs in, said as JSON, a line each: node sign_in.mjs URL TOKEN
import { Param, Ros, Service } from "roslib";

const tell = (name, value) => console.log(JSON.stringify({ [name]: value }));
const called = (ros, name, type, request) =>
  new Promise((done, failed) => new Service({ ros, name, serviceType: type }).callService(request, done, failed));
const speed = (ros) => new Promise((done, failed) => new Param({ ros, name: "/maya/speed" }).get(done, failed));

const [url, token] = process.argv.slice(2);
const ros = new Ros({ url });
await new Promise((done, failed) => {
  ros.on("connection", done);
  ros.on("error", failed);
});
tell("stop", (await called(ros, "/controller/stop", "std_srvs/Trigger", {})).success);
await speed(ros).catch((refusal) => tell("before", String(refusal)));
ros.authenticate(token, "", "", "", 0, "", 0);
tell("speed", await speed(ros));
tell("gripper", (await called(ros, "/gripper", "std_srvs/SetBool", { data: true })).success);
tell("done", true);
ros.close();
