-- Runs an applet as the scheduler of ArduPilot does, with scripted bindings and a simulated clock.
--
--     lua5.3 autopilot.lua APPLET MILLISECONDS LATE [MS STOPPED SAFE]...
--
-- Every run is LATE ms later than the applet asks for. From each MS on, the bindings return STOPPED and SAFE: true,
-- false or nil. "none" as STOPPED: the firmware has no such binding. Standard output: "sent MS NAME VALUE" for each
-- message, "text SEVERITY TEXT" for each text, "runs N", "allocated BYTES" by the runs after the first second.

local applet, duration, late = arg[1], tonumber(arg[2]), tonumber(arg[3])
local VALUES = { ["true"] = true, ["false"] = false }

local now = 0
local at, stops, safes = {}, {}, {}
for i = 4, #arg, 3 do
    at[#at + 1] = tonumber(arg[i])
    stops[#at], safes[#at] = VALUES[arg[i + 1]], VALUES[arg[i + 2]]
end

local function step()
    local current = 1
    for i = 1, #at do
        if at[i] <= now then
            current = i
        end
    end
    return current
end

local MOST = 1000
local times, names, values, sent = {}, {}, {}, 0 -- filled here, so that a message allocates nothing
for i = 1, MOST do
    times[i], names[i], values[i] = 0, "", 0
end

gcs = {}
function gcs.send_named_float(_, name, value)
    sent = sent + 1
    times[sent], names[sent], values[sent] = now, name, value
end
function gcs.send_text(_, severity, text)
    print("text", severity, text)
end

SRV_Channels = {}
if arg[5] ~= "none" then
    function SRV_Channels.get_emergency_stop()
        return stops[step()]
    end
    function SRV_Channels.get_safety_state()
        return safes[step()]
    end
end

collectgarbage("stop")
local run, delay = assert(loadfile(applet))()
local runs, allocated = 1, 0
while run and now < duration do
    now = now + delay + late
    local before = collectgarbage("count")
    run, delay = run()
    local after = collectgarbage("count")
    runs = runs + 1
    if now > 1000 then
        allocated = allocated + (after - before) * 1024
    end
end

for i = 1, sent do
    print("sent", times[i], names[i], values[i])
end
print("runs", runs)
print("allocated", allocated)
