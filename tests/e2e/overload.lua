-- wrk's scenes, each another one; it waits as long as it is told between requests of a connection.
-- The identifier of a request comes back with its answer: that is how its time is known.
local ffi = require("ffi")
ffi.cdef [[
    typedef struct { long seconds, nanoseconds; } load_time;
    int clock_gettime(int clock, load_time *out);
]]
local time = ffi.new("load_time")
local threads = {}

local function now()
    ffi.C.clock_gettime(1, time)
    return tonumber(time.seconds) + tonumber(time.nanoseconds) * 1e-9
end

function setup(thread)
    thread:set("index", #threads)
    table.insert(threads, thread)
end

function init(arguments)
    pause, body, first = tonumber(arguments[1]), arguments[2], tonumber(arguments[3])
    count, began, counts, taken = 0, {}, {}, {}
end

function delay()
    -- The first requests are spread, and so are all after them.
    return math.floor(pause * (0.5 + math.random()))
end

function request()
    count = count + 1
    local id = index .. "-" .. count
    local fov = string.format("%.9f", 30 + 10 * index + (first + count) * 1e-6)
    began[id] = now()
    return wrk.format("POST", "/v1/render",
                      {["Content-Type"] = "application/json", ["X-Request-Id"] = id},
                      (body:gsub("FOV", fov)))
end

function response(status, headers)
    counts[status] = (counts[status] or 0) + 1
    local id = headers["X-Request-Id"] or headers["x-request-id"] or ""
    if status == 200 and began[id] then table.insert(taken, now() - began[id]) end
    began[id] = nil
end

-- One line, in JSON: answers by status, seconds that the accepted took, what went wrong.
function done(summary)
    local all, accepted, list = {}, {}, {}
    for _, thread in ipairs(threads) do
        for status, number in pairs(thread:get("counts")) do
            all[status] = (all[status] or 0) + number
        end
        for _, seconds in ipairs(thread:get("taken")) do table.insert(accepted, seconds) end
    end
    table.sort(accepted)
    local function share(part)
        return accepted[math.max(1, math.ceil(part * #accepted))] or 0
    end
    for status, number in pairs(all) do
        table.insert(list, string.format('"%d": %d', status, number))
    end
    local e = summary.errors
    print(string.format(
        '{"statuses": {%s}, "seconds": %.3f, "p50": %.4f, "p99": %.4f, "most": %.4f, ' ..
            '"errors": {"connect": %d, "read": %d, "write": %d, "timeout": %d}}',
        table.concat(list, ", "), summary.duration / 1e6, share(0.5), share(0.99), share(1),
        e.connect, e.read, e.write, e.timeout))
end
