// What the pages have beyond reading: the studio's choice of light or dark, blocks that are copied by a
// click, and pictures of a daemon that asks for the token which the studio was given in this tab.

const theme = localStorage.getItem("shaded-theme");
if (theme) document.documentElement.dataset.theme = theme;

for (const block of document.querySelectorAll("pre")) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "quiet copy";
    button.textContent = "Copy";
    const text = block.textContent;
    button.addEventListener("click", async () => {
        await navigator.clipboard.writeText(text);
        button.textContent = "Copied";
        setTimeout(() => { button.textContent = "Copy"; }, 1500);
    });
    if (navigator.clipboard) block.append(button);
}

// One request at a time: a page of pictures is no reason to fill a daemon's queue.
let turn = Promise.resolve();
async function fetchPicture(image) {
    const token = sessionStorage.getItem("shaded-token");
    const headers = token ? { Authorization: `Bearer ${token}` } : {};
    for (let tries = 0; tries < 20; tries++) {
        const answer = await fetch(image.dataset.src, { headers });
        if (answer.ok) {
            image.src = URL.createObjectURL(await answer.blob());
            return;
        }
        if (answer.status !== 429) return;
        await new Promise(done => setTimeout(done, 1000 * (answer.headers.get("Retry-After") ?? 1)));
    }
}

function again(image) {
    if (image.dataset.src || !new URL(image.src).pathname.includes("/v1/")) return;
    image.dataset.src = image.src;
    turn = turn.then(() => fetchPicture(image)).catch(() => {});
}

for (const image of document.images) {
    if (image.complete && !image.naturalWidth && image.currentSrc) again(image);
    image.addEventListener("error", () => again(image));
}
