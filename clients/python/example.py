from uwguide import Client

with Client("127.0.0.1:7475") as daemon:
    advice = daemon.suggest(
        depth_m=3.0, distance_m=1.0, light_pct=20.0,
        mean=[41.0, 88.0, 79.0], std=[4.1, 7.7, 6.2], width=1280, height=720,
    )
    if advice["valid"] and advice["action"] == "move":
        print(f"go to {advice['distance_m']:.2f} m, lamps to {advice['light_pct']:.0f} %")
        print(advice["why"])
    else:
        print("hold:", advice["reason"], "-", advice["message"])
