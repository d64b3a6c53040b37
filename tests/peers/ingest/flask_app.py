"""The set-up of the paper: Flask behind gunicorn, SQLite. One row a frame, a commit that is synced before the answer.

    gunicorn --workers 2 --bind 127.0.0.1:PORT flask_app:app      with INGEST_STORE=FILE
"""

import struct

from flask import Flask, jsonify, request

import table

app = Flask(__name__)
app.logger.disabled = True


@app.post("/v1/frames")
def frames():
    batch = request.get_json()
    return jsonify(table.keep(batch, struct.pack))
