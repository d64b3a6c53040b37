// The link from the live page to the scene editor.

import { brought } from "./brought.js";

brought.links.push({ id: "to-editor", title: "Scenes", href: "/editor", key: "e", says: "edit scenes" });
